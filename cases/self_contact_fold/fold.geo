// A strip of three flanks and two bends, in quadrilaterals.
length = 1;
thick = 0.06;
pitch = 0.2;
DefineConstant[ along = 24, around = 8, across = 3 ];

inner = 0.5 * (pitch - thick);
outer = 0.5 * (pitch + thick);
middle = 0.5 * (pitch + thick);

// flanks: lower left, lower right, upper right, upper left
For k In {0:2}
  Point(10 * k + 1) = {0, k * pitch, 0};
  Point(10 * k + 2) = {length, k * pitch, 0};
  Point(10 * k + 3) = {length, k * pitch + thick, 0};
  Point(10 * k + 4) = {0, k * pitch + thick, 0};
EndFor
// bends: centre, the middle of the inner and of the outer side
Point(41) = {length, middle, 0};
Point(42) = {length + inner, middle, 0};
Point(43) = {length + outer, middle, 0};
Point(51) = {0, pitch + middle, 0};
Point(52) = {-inner, pitch + middle, 0};
Point(53) = {-outer, pitch + middle, 0};

For k In {0:2}
  Line(10 * k + 1) = {10 * k + 1, 10 * k + 2};
  Line(10 * k + 2) = {10 * k + 2, 10 * k + 3};
  Line(10 * k + 3) = {10 * k + 4, 10 * k + 3};
  Line(10 * k + 4) = {10 * k + 1, 10 * k + 4};
EndFor
Circle(41) = {3, 41, 42};
Circle(42) = {42, 41, 12};
Circle(43) = {2, 41, 43};
Circle(44) = {43, 41, 13};
Line(45) = {43, 42};
Circle(51) = {14, 51, 52};
Circle(52) = {52, 51, 21};
Circle(53) = {11, 51, 53};
Circle(54) = {53, 51, 24};
Line(55) = {53, 52};

For k In {0:2}
  Curve Loop(k + 1) = {10 * k + 1, 10 * k + 2, -(10 * k + 3), -(10 * k + 4)};
EndFor
Curve Loop(4) = {43, 45, -41, -2};
Curve Loop(5) = {44, -12, -42, -45};
Curve Loop(6) = {53, 55, -51, -14};
Curve Loop(7) = {54, -24, -52, -55};
For k In {1:7}
  Plane Surface(k) = {k};
EndFor

Transfinite Curve {1, 3, 11, 13, 21, 23} = along + 1;
Transfinite Curve {2, 4, 12, 14, 22, 24, 45, 55} = across + 1;
Transfinite Curve {41, 42, 43, 44, 51, 52, 53, 54} = around + 1;
Transfinite Surface {1:7};
Recombine Surface {1:7};

Physical Surface("strip") = {1:7};
Physical Curve("bottom") = {1};
Physical Curve("top") = {23};
Physical Curve("inside") = {3, 41, 42, 11, 53, 54, 13, 51, 52, 21, 43, 44};
