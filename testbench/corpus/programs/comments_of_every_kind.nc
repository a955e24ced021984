%
O15 (NAME: PLATE_7, REV "B" & 100%)
; a whole line with (brackets) in it and G00 X99
G21 (mm) G90 (absolute) G17
(G00 X50.)
G00 (to the start) X1. (only X) Y2. ; and Y
()
G01 X3.(near) F60.
N5 (block number and nothing else)
; last words
M02 (end)
%
