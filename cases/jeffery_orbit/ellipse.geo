// An ellipse about the origin, upright: its long half axis is along y.
DefineConstant[ long = 1, short = 0.5, facets = 200 ];

SetFactory("OpenCASCADE");
Ellipse(1) = {0, 0, 0, long, short};
Rotate {{0, 0, 1}, {0, 0, 0}, Pi/2} { Curve{1}; }
Curve Loop(1) = {1};
Plane Surface(1) = {1};
Transfinite Curve {1} = facets + 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeMax = 0.5;
Physical Surface("ellipse") = {1};
Physical Curve("outer") = {1};
