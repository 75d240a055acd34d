"""Contact modes of a node, common to all schemes, as plain numbers for compiled kernels.

FREE: no constraint. STICK: it moves with the surface. SLIP: its normal velocity is that of the
surface. HELD: a gripper moves it. RAIL: for one step it moves only along a line between two
surfaces.
"""

FREE, STICK, SLIP, HELD, RAIL = 0, 1, 2, 3, 4
