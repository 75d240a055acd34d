"""What contact does with a node: the same for all schemes, plain numbers for compiled kernels.

FREE: nothing. STICK: it moves with the surface. SLIP: its normal velocity is that of the surface.
HELD: a gripper moves it. RAIL: for one step it moves along a line only, between two surfaces.
"""

FREE, STICK, SLIP, HELD, RAIL = 0, 1, 2, 3, 4
