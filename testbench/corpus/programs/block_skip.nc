%
G21 G90
G00 X1.
/ G00 X50.
/N30 X60.
 / (blank before it) X70.
G01 X2. F60.
M02
%
