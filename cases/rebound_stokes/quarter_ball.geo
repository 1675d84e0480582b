// A quarter of a ball about the origin, x >= 0 and y >= 0: planes of symmetry x = 0 (left) and y = 0 (front).
// Edges are `fine` long within 0.2 radii of the lowest point, and grow to `size` at a distance of one radius.
DefineConstant[ radius = 0.5, size = 0.14, fine = 0.025 ];

SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 0, radius, -Pi/2, Pi/2, Pi/2};
Point(1000) = {0, 0, -radius};

Field[1] = Distance;
Field[1].PointsList = {1000};
Field[2] = Threshold;
Field[2].InField = 1;
Field[2].SizeMin = fine;
Field[2].SizeMax = size;
Field[2].DistMin = 0.2 * radius;
Field[2].DistMax = radius;
Background Field = 2;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;
Mesh.MeshSizeExtendFromBoundary = 0;

tiny = 0.001 * radius;
left() = Surface In BoundingBox {-tiny, -tiny, -2 * radius, tiny, 2 * radius, 2 * radius};
front() = Surface In BoundingBox {-tiny, -tiny, -2 * radius, 2 * radius, tiny, 2 * radius};
all() = Surface{:};
outer() = all();
outer() -= left();
outer() -= front();

Physical Volume("ball") = {1};
Physical Surface("left") = left();
Physical Surface("front") = front();
Physical Surface("outer") = outer();
