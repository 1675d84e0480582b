// 24 x 12, cells of 0.05 where the cylinder touches, growing by a quarter each away from it.
fine = 1.3;
half = 12;
Point(1) = {-half, 0, 0};
Point(2) = {-fine, 0, 0};
Point(3) = {fine, 0, 0};
Point(4) = {half, 0, 0};
Point(5) = {-half, -half, 0};
Point(6) = {-fine, -half, 0};
Point(7) = {fine, -half, 0};
Point(8) = {half, -half, 0};
Line(1) = {2, 1};
Line(2) = {2, 3};
Line(3) = {3, 4};
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
Physical Surface("half_space") = {1:3};
Physical Curve("touching") = {1, 2, 3};
Physical Curve("far") = {4, 5, 6};
