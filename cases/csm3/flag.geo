// The elastic flag of Turek and Hron behind a cylinder: its left end is an arc of the cylinder.
// refine = 1 gives 35 x 2 cells, refine = 2 gives 70 x 4, and so on; point A = (0.6, 0.2) is always a node.
DefineConstant[ refine = 1 ];

centre = 0.2;      // of the cylinder, x and y
radius = 0.05;
half = 0.01;       // of the flag's thickness
tip = 0.6;
root = centre + Sqrt(radius^2 - half^2);

Point(1) = {root, centre - half, 0};
Point(2) = {tip, centre - half, 0};
Point(3) = {tip, centre + half, 0};
Point(4) = {root, centre + half, 0};
Point(5) = {centre, centre, 0};

Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Circle(4) = {4, 5, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};

Transfinite Curve {1, 3} = 35 * refine + 1;
Transfinite Curve {2, 4} = 2 * refine + 1;
Transfinite Surface {1};
Recombine Surface {1};

Physical Surface("flag") = {1};
Physical Curve("bottom") = {1};
Physical Curve("tip") = {2};
Physical Curve("top") = {3};
Physical Curve("clamp") = {4};
