// Quadrature rules on the line [-1, 1] and on the unit triangle.
#pragma once

#include <array>
#include <cmath>
#include <vector>

namespace mortar {

struct RulePoint {
    double x[2], weight;
};

// Gauss-Legendre, 4 or 5 points: exact for degree 7 or 9.
inline std::vector<RulePoint> line_rule(int points) {
    std::vector<RulePoint> rule;
    auto both_sides = [&](double x, double weight) {
        rule.push_back({{-x, 0.0}, weight});
        rule.push_back({{x, 0.0}, weight});
    };
    if (points == 4) {
        const double r = std::sqrt(6.0 / 5.0), s = std::sqrt(30.0);
        both_sides(std::sqrt(3.0 / 7.0 - 2.0 / 7.0 * r), (18.0 + s) / 36.0);
        both_sides(std::sqrt(3.0 / 7.0 + 2.0 / 7.0 * r), (18.0 - s) / 36.0);
    } else {
        const double r = 2.0 * std::sqrt(10.0 / 7.0), s = 13.0 * std::sqrt(70.0);
        both_sides(std::sqrt(5.0 - r) / 3.0, (322.0 + s) / 900.0);
        both_sides(std::sqrt(5.0 + r) / 3.0, (322.0 - s) / 900.0);
        rule.push_back({{0.0, 0.0}, 128.0 / 225.0});
    }
    return rule;
}

inline std::vector<RulePoint> square_rule(int points) {
    std::vector<RulePoint> rule;
    for (const RulePoint& p : line_rule(points))
        for (const RulePoint& q : line_rule(points)) rule.push_back({{p.x[0], q.x[0]}, p.weight * q.weight});
    return rule;
}

// 7 points, degree 5 (Radon 1948); 12 points, degree 6 (Dunavant 1985). Weights sum to the area 1/2.
inline std::vector<RulePoint> triangle_rule(int points) {
    std::vector<RulePoint> rule;
    auto orbit_3 = [&](double a, double weight) {
        const double b = 1.0 - 2.0 * a;
        for (auto [x, y] : {std::array{a, a}, {a, b}, {b, a}}) rule.push_back({{x, y}, 0.5 * weight});
    };
    auto orbit_6 = [&](double a, double b, double weight) {
        const double c = 1.0 - a - b;
        for (auto [x, y] : {std::array{a, b}, {b, a}, {b, c}, {c, b}, {c, a}, {a, c}})
            rule.push_back({{x, y}, 0.5 * weight});
    };
    if (points == 7) {
        const double s = std::sqrt(15.0);
        rule.push_back({{1.0 / 3.0, 1.0 / 3.0}, 9.0 / 80.0});
        orbit_3((6.0 - s) / 21.0, (155.0 - s) / 1200.0);
        orbit_3((6.0 + s) / 21.0, (155.0 + s) / 1200.0);
    } else {
        orbit_3(0.24928674517091042129, 0.11678627572637936603);
        orbit_3(0.06308901449150222834, 0.05084490637020681692);
        orbit_6(0.05314504984481694735, 0.31035245103378440542, 0.08285107561837357519);
    }
    return rule;
}

// Fixed points on a facet (element-based integration; Farah, Popp & Wall 2015).
template <typename Facet>
const std::vector<RulePoint>& element_rule() {
    static const std::vector<RulePoint> rule = [] {
        if (Facet::dim == 2) return line_rule(5);
        if (Facet::nodes == 3 || Facet::nodes == 6) return triangle_rule(12);
        return square_rule(3 + Facet::order);
    }();
    return rule;
}

}  // namespace mortar
