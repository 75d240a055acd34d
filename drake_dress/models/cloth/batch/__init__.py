"""Many garments of one mesh in one call, on the CPU or a CUDA device (Warp, imported on use)."""
