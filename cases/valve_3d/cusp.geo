// A flat cusp of a valve with three: a sector of 120 degrees in plan. It is tilted, its corner on the axis is `rise` above
// those on the wall, which are at `height`. When it closes, it sags, and its sides move towards the radial planes between
// it and the others. At rest they are so far from these planes that they meet over their whole length.
DefineConstant[ radius = 1.04, height = 0.52, rise = 0.35, thickness = 0.04, size = 0.2 ];
slope = 2 * rise / radius;
// distance of a side from its radial plane, in 1e-3, at radii from the axis to the wall
where() = {0, 0.09, 0.18, 0.26, 0.35, 0.52, 0.78, 0.87, 0.95, 1.04};
apart() = {5.6, 5.75, 5.6, 5.2, 4.4, 2.7, 0.6, 0.15, 0, 0};
c = Cos(Pi / 3);
s = Sin(Pi / 3);
For i In {1 : 9}
  d = 1e-3 * apart(i);
  x = where(i) * c + d * s;
  y = where(i) * s - d * c;
  Point(10 + i) = {x, y, height + rise - slope * x, size};
  Point(20 + i) = {x, -y, height + rise - slope * x, size};
EndFor
x = 1e-3 * apart(0) / s;
Point(1) = {x, 0, height + rise - slope * x, size};
Point(2) = {radius, 0, height + rise - slope * radius, size};
Point(3) = {0, 0, height + rise, size};
Spline(1) = {1, 21, 22, 23, 24, 25, 26, 27, 28, 29};
Ellipse(2) = {29, 3, 2, 2};
Ellipse(3) = {2, 3, 2, 19};
Spline(4) = {19, 18, 17, 16, 15, 14, 13, 12, 11, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Recombine Surface{1};
Mesh.Algorithm = 8;
Mesh.RecombinationAlgorithm = 3;
out[] = Extrude {0, 0, thickness} { Surface{1}; Layers{1}; Recombine; };
Physical Volume("cusp") = {out[1]};
Physical Surface("lower") = {1};
Physical Surface("upper") = {out[0]};
Physical Surface("right") = {out[2]};
Physical Surface("arc") = {out[3], out[4]};
Physical Surface("left") = {out[5]};
