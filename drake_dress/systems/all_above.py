"""Tells whether several scalars are all above a threshold."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, InputPort, LeafSystem


class AllAbove(LeafSystem):
    """Outputs 1 while every input is above a threshold, else 0.

    .. pydrake_system::

        name: AllAbove
        input_ports:
        - u0
        - (one for each scalar)
        output_ports:
        - all_above

    Inputs and output: (1,).

    Args:
        count: Number of inputs.
        threshold: Threshold, in the inputs' unit.
    """

    def __init__(self, count: int, threshold: float) -> None:
        super().__init__()
        self._threshold = threshold
        self.ports: list[InputPort] = [
            self.DeclareVectorInputPort(f"u{k}", 1) for k in range(count)
        ]
        self.DeclareVectorOutputPort("all_above", 1, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        above = all(port.Eval(context)[0] > self._threshold for port in self.ports)
        output.SetFromVector([float(above)])
