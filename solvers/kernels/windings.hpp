// Angles under which closed surfaces are seen from points.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

// Sum of the angles of segments (D = 2), or of halves of the solid angles of triangles (D = 3), seen from each point.
// A facet whose plane contains the point, up to the sine `in_plane` of the angle, contributes zero: rounding would
// decide its sign.
// Source: van Oosterom, Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125-126.
template <int D>
void seen_angles(const double* points, std::size_t count, const double* vertices, std::size_t vertex_count,
                 const std::int64_t* facets, std::size_t facet_count, double in_plane, double* found) {
    using Point = std::array<double, D>;
    const auto dot = [](const Point& a, const Point& b) {
        double sum = 0;
        for (int d = 0; d < D; ++d) sum += a[d] * b[d];
        return sum;
    };
    std::vector<Point> ways(vertex_count);
    std::vector<double> lengths(vertex_count);
    for (std::size_t p = 0; p < count; ++p) {
        for (std::size_t v = 0; v < vertex_count; ++v) {
            for (int d = 0; d < D; ++d) ways[v][d] = vertices[D * v + d] - points[D * p + d];
            lengths[v] = std::sqrt(dot(ways[v], ways[v]));
        }
        double sum = 0;
        for (std::size_t f = 0; f < facet_count; ++f) {
            const std::int64_t* corners = facets + D * f;
            const Point &a = ways[corners[0]], &b = ways[corners[1]];
            const double la = lengths[corners[0]], lb = lengths[corners[1]];
            double across, along, product = la * lb;
            if constexpr (D == 2) {
                across = a[0] * b[1] - a[1] * b[0];
                along = dot(a, b);
            } else {
                const Point& c = ways[corners[2]];
                const double lc = lengths[corners[2]];
                across = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                         a[2] * (b[0] * c[1] - b[1] * c[0]);
                along = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
                product *= lc;
            }
            if (std::abs(across) > in_plane * product) sum += std::atan2(across, along);
        }
        found[p] = sum;
    }
}
