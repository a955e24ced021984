%
G21	G90
G 00  X 1.5	Y -2
	G01	X	3 F 120
   Y 4   
M 02
%
