// The cap of a cylinder of radius 200 with its axis at (0, 200), 24 wide and 12 high.
fine = 1.3;
half = 12;
radius = 200;
Point(1) = {-half, radius - Sqrt(radius^2 - half^2), 0};
Point(2) = {-fine, radius - Sqrt(radius^2 - fine^2), 0};
Point(3) = {fine, radius - Sqrt(radius^2 - fine^2), 0};
Point(4) = {half, radius - Sqrt(radius^2 - half^2), 0};
Point(5) = {-half, half, 0};
Point(6) = {-fine, half, 0};
Point(7) = {fine, half, 0};
Point(8) = {half, half, 0};
Point(9) = {0, radius, 0};
Circle(1) = {2, 9, 1};
Circle(2) = {2, 9, 3};
Circle(3) = {3, 9, 4};
Line(4) = {6, 5};
Line(5) = {6, 7};
Line(6) = {7, 8};
Line(11) = {1, 5};
Line(12) = {2, 6};
Line(13) = {3, 7};
Line(14) = {4, 8};
Curve Loop(1) = {1, 11, -4, -12};
Curve Loop(2) = {2, 13, -5, -12};
Curve Loop(3) = {3, 14, -6, -13};
For k In {1:3}
  Plane Surface(k) = {k};
EndFor
Transfinite Curve {2, 5} = 53;
Transfinite Curve {1, 3, 4, 6, 11, 12, 13, 14} = 19 Using Progression 1.25;
Transfinite Surface {1:3};
Recombine Surface {1:3};
Physical Surface("cylinder") = {1:3};
Physical Curve("touching") = {1, 2, 3};
Physical Curve("far") = {4, 5, 6};
