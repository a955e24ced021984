%
o7 (small)
g21 g90 g94
g00 x1.5 y2.5
g01 x3 f120
m02
%
