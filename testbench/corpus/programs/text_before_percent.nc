Part 4711, order 12, two pieces
saved by the office on a Monday

%
O11
G21 G90
G00 X1. Y3.
G01 Y5. F60.
M30
%
