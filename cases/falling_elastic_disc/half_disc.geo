// The half x >= 0 of a disc about the origin: left is the plane of symmetry, x = 0.
// Edges are `fine` long within 0.2 radii of the lowest point, and grow to `size` at a distance of one radius.
DefineConstant[ radius = 0.011, size = 0.002, fine = 0.00025 ];

Point(1) = {0, -radius, 0};
Point(2) = {0, 0, 0};
Point(3) = {0, radius, 0};
Point(4) = {radius, 0, 0};
Circle(1) = {1, 2, 4};
Circle(2) = {4, 2, 3};
Line(3) = {3, 2};
Line(4) = {2, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};

Field[1] = Distance;
Field[1].PointsList = {1};
Field[2] = Threshold;
Field[2].InField = 1;
Field[2].SizeMin = fine;
Field[2].SizeMax = size;
Field[2].DistMin = 0.2 * radius;
Field[2].DistMax = radius;
Background Field = 2;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeExtendFromBoundary = 0;

Physical Surface("disc") = {1};
Physical Curve("left") = {3, 4};
Physical Curve("outer") = {1, 2};
