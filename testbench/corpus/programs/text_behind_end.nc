%
G21 G90
G00 X1.
M30
G00 X50.
operator: call me
