%
G21 G90 (100 % speed)
G00 X1. ; 50 % of it
M30
%
