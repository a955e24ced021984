%
G21 G90 (größer, 5 µm, 20 °C – „gut“)
G00 X1. ; Düse öffnen
M02
%
