%
G21 G90
G00 X1. (never closed
M02
%
