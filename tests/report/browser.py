"""Pages as headless Chromium shows them."""

from __future__ import annotations

import shutil
import subprocess
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest
from matplotlib import image

from drake_dress.models.arrays import FloatArray

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="no chromium on the path: pages cannot be looked at"
)

_TIME_LIMIT = 60.0  # s


def live_screenshot(url: str, folder: Path, name: str, wait: float = 4.0) -> FloatArray:
    """Returns (600, 900, 3) what a live page shows some seconds of real time after its opening.

    Chromium takes its picture when a page has loaded, which a live page has before it got what
    it shows. So the page is framed by one that is not loaded until a picture in it arrives.
    """

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            frame = "position:fixed;inset:0;width:100%;height:100%;border:0"
            body = f'<body><iframe src="{url}" style="{frame}"></iframe><img src="/late.png">'
            if self.path == "/late.png":
                time.sleep(wait)
                body = ""
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(body.encode())

        def log_message(self, format: str, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("localhost", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            address = f"http://localhost:{server.server_address[1]}/"
            return screenshot(address, folder, name, virtual_time=None)
        finally:
            server.shutdown()


def screenshot(url: str, folder: Path, name: str, virtual_time: float | None = 4.0) -> FloatArray:
    """Returns (600, 900, 3) what a page shows, 0 to 1.

    Args:
        url: of the page.
        folder: for the picture and the browser's profile.
        name: of the picture, without extension.
        virtual_time: s the page believes to have passed; None: until it has loaded.
    """
    picture = folder / f"{name}.png"
    pace = []
    if virtual_time is not None:
        pace = [f"--virtual-time-budget={round(1e3 * virtual_time)}"]
    command = [
        str(CHROMIUM),
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--hide-scrollbars",
        "--window-size=900,600",
        *pace,
        f"--screenshot={picture}",
    ]

    def take(profile: str) -> subprocess.CompletedProcess[str]:
        place = f"--user-data-dir={folder / profile}"
        return subprocess.run(
            [*command, place, url],
            capture_output=True,
            text=True,
            timeout=_TIME_LIMIT,
            check=False,
        )

    try:
        done = take(f"profile-{name}")
    except subprocess.TimeoutExpired:
        # now and then the browser itself hangs before it has begun
        done = take(f"profile-{name}-again")
    if not picture.is_file():
        raise RuntimeError(f"chromium made no picture of {url}: {done.stderr[-800:]}")
    return np.asarray(image.imread(picture), dtype=np.float64)[:, :, :3]
