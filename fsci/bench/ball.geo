// The lower half of a quarter of a ball of radius 1 that stands on the origin, with small cells where it touches a plane.
SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 1, 1, -Pi/2, 0, Pi/2};
Field[1] = MathEval;
Field[1].F = "0.0016 + 0.25*(Sqrt(x^2 + y^2 + z^2) - 0.014 + Fabs(Sqrt(x^2 + y^2 + z^2) - 0.014))/2";
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
tiny = 1e-5;
left() = Surface In BoundingBox {-tiny, -tiny, -tiny, tiny, 1 + tiny, 1 + tiny};
front() = Surface In BoundingBox {-tiny, -tiny, -tiny, 1 + tiny, tiny, 1 + tiny};
top() = Surface In BoundingBox {-tiny, -tiny, 1 - tiny, 1 + tiny, 1 + tiny, 1 + tiny};
all() = Surface{:};
bottom() = all();
bottom() -= left();
bottom() -= front();
bottom() -= top();

Physical Volume("ball") = {1};
Physical Surface("left") = left();
Physical Surface("front") = front();
Physical Surface("top") = top();
Physical Surface("bottom") = bottom();
