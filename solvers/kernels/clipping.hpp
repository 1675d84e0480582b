// The overlap of two convex polygons in the plane: Sutherland & Hodgman (1974), and how it depends on both.
//
// The polygon is found in plain numbers. Every vertex remembers where it comes from - a slave corner, a master corner,
// or a crossing of two edges - and is evaluated from there once more, with derivatives. So nothing is differentiated
// that was only met on the way, and nearly coincident edges do no harm: a corner within `slack` of a clipping line is
// on it and stays as it is. Corners of the slave are kept where both polygons have one, because a facet covered by
// several masters is covered whichever way they move.
#pragma once

#include <cmath>

#include "dual_number.hpp"

namespace mortar {

constexpr double slack = 1e-12;  // in plane coordinates, where the slave facet has size one or two
constexpr int max_vertices = 12;

// Edges (and the corners they start from) are numbered 0.. on the slave, 8.. on the master.
constexpr int master_edge = 8;

struct Vertex {
    double x[2];
    int first, second;  // crossing of two edges; equal: the corner where that edge starts
    int edge;           // the line to the next vertex
};

struct Polygon {
    Vertex vertex[max_vertices];
    int size = 0;

    void push(const double* x, int first, int second, int edge) {
        if (size < max_vertices) vertex[size++] = {{x[0], x[1]}, first, second, edge};
    }
    double area() const {
        double twice = 0.0;
        for (int k = 1; k + 1 < size; ++k) {
            const double *o = vertex[0].x, *a = vertex[k].x, *b = vertex[k + 1].x;
            twice += (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
        }
        return 0.5 * twice;
    }
};

// The slave polygon cut by the master polygon; both counter-clockwise.
template <int ns, int nm>
Polygon clip(const double (*slave)[2], const double (*master)[2]) {
    Polygon polygon;
    for (int i = 0; i < ns; ++i) polygon.push(slave[i], i, i, i);

    for (int e = 0; e < nm && polygon.size > 0; ++e) {
        const double *a = master[e], *b = master[(e + 1) % nm];
        const double along[2] = {b[0] - a[0], b[1] - a[1]};
        const double length = std::sqrt(along[0] * along[0] + along[1] * along[1]);
        if (length == 0.0) continue;  // two corners in one place bound nothing

        double distance[max_vertices];  // to the left of the line, the inside
        bool cut = false, kept = false;
        for (int k = 0; k < polygon.size; ++k) {
            const double* x = polygon.vertex[k].x;
            const double d = (along[0] * (x[1] - a[1]) - along[1] * (x[0] - a[0])) / length;
            distance[k] = std::abs(d) <= slack ? 0.0 : d;
            cut |= distance[k] < 0.0;
            kept |= distance[k] > 0.0;
        }
        if (!cut) continue;
        if (!kept) return {};

        const Polygon whole = polygon;
        const int line = master_edge + e, before = master_edge + (e + nm - 1) % nm, after = master_edge + (e + 1) % nm;
        polygon.size = 0;
        for (int k = 0; k < whole.size; ++k) {
            const int next = (k + 1) % whole.size;
            const Vertex &from = whole.vertex[k], &to = whole.vertex[next];
            const double d = distance[k], d_next = distance[next];
            if (d >= 0.0) polygon.push(from.x, from.first, from.second, d == 0.0 && d_next < 0.0 ? line : from.edge);
            if (d * d_next >= 0.0) continue;
            const double t = d / (d - d_next);
            const double x[2] = {from.x[0] + t * (to.x[0] - from.x[0]), from.x[1] + t * (to.x[1] - from.x[1])};
            const int edge = d > 0.0 ? line : from.edge;
            if (from.edge == before)  // consecutive edges of the master meet in its corner
                polygon.push(x, line, line, edge);
            else if (from.edge == after)
                polygon.push(x, after, after, edge);
            else
                polygon.push(x, from.edge, line, edge);
        }
    }
    return polygon;
}

// The line through two points.
template <typename T>
struct Line {
    const T *a, *b;
};

// Where the first line meets the second.
template <typename T>
void crossing(const Line<T>& first, const Line<T>& second, T* x) {
    const T along[2] = {second.b[0] - second.a[0], second.b[1] - second.a[1]};
    auto side = [&](const T* p) { return along[0] * (p[1] - second.a[1]) - along[1] * (p[0] - second.a[0]); };
    const T from = side(first.a), to = side(first.b), t = from / (from - to);
    for (int c = 0; c < 2; ++c) x[c] = first.a[c] + t * (first.b[c] - first.a[c]);
}

}  // namespace mortar
