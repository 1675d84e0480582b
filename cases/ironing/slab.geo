// 12 x 4, the cells finer towards the top.
Point(1) = {0, 0, 0};
Point(2) = {12, 0, 0};
Point(3) = {12, 4, 0};
Point(4) = {0, 4, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {4, 3};
Line(4) = {1, 4};
Curve Loop(1) = {1, 2, -3, -4};
Plane Surface(1) = {1};
Transfinite Curve {1, 3} = 49;
Transfinite Curve {2, 4} = 9 Using Progression 0.82;
Transfinite Surface {1};
Recombine Surface {1};
Physical Surface("slab") = {1};
Physical Curve("bottom") = {1};
Physical Curve("top") = {3};
