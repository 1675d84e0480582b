// 1.2 wide, with a lower arc of radius 0.75; its apex is 0.2 above the slab.
Point(1) = {0.2, 4.5, 0};
Point(2) = {1.4, 4.5, 0};
Point(3) = {1.4, 5.4, 0};
Point(4) = {0.2, 5.4, 0};
Point(5) = {0.8, 4.95, 0};
Circle(1) = {1, 5, 2};
Line(2) = {2, 3};
Line(3) = {4, 3};
Line(4) = {1, 4};
Curve Loop(1) = {1, 2, -3, -4};
Plane Surface(1) = {1};
Transfinite Curve {1, 3} = 9;
Transfinite Curve {2, 4} = 7;
Transfinite Surface {1};
Recombine Surface {1};
Physical Surface("indenter") = {1};
Physical Curve("bottom") = {1};
Physical Curve("top") = {3};
