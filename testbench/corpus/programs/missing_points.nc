%
(whole millimetres, and points in odd places)
G21 G90
G00 X10 Y5
G01 X.5 Y5. F60
X-.25 Y-0.
X+2. Y+.75
M02
%
