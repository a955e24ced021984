%
O13
G21 G90
G00 X1. Y3.
M30
%
O14
G00 X99999.
tool list: 1 electrode, 2 wires
%
