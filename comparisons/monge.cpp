// Principal curvatures by CGAL's Monge_via_jet_fitting, on neighbourhoods that are read from a file.
//
//     monge IN OUT, binary in the machine's own order:
//     IN    int64 n, m, degree; double points (n, 3), normals (n, 3); int64 offsets (n + 1), neighbours (m)
//     OUT   double k1, k2 (n, 2), k1 >= k2, positive where the surface bends away from the normal;
//           NaN where there are too few neighbours
#include <CGAL/Simple_cartesian.h>

#include <CGAL/Monge_via_jet_fitting.h>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <vector>

using Kernel = CGAL::Simple_cartesian<double>;
using Fitting = CGAL::Monge_via_jet_fitting<Kernel>;

template <class T>
std::vector<T> take(std::istream &in, std::size_t count) {
    std::vector<T> values(count);
    in.read(reinterpret_cast<char *>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
    return values;
}

int main(int argc, char **argv) {
    if (argc != 3) return 2;
    std::ifstream in(argv[1], std::ios::binary);
    const auto sizes = take<std::int64_t>(in, 3);
    const std::size_t n = sizes[0], m = sizes[1], degree = sizes[2];
    const auto points = take<double>(in, 3 * n), normals = take<double>(in, 3 * n);
    const auto offsets = take<std::int64_t>(in, n + 1), neighbours = take<std::int64_t>(in, m);
    if (!in) return 3;

    std::vector<double> curvatures(2 * n, std::nan(""));
    std::vector<Kernel::Point_3> around;
    for (std::size_t i = 0; i < n; ++i) {
        around.assign(1, {points[3 * i], points[3 * i + 1], points[3 * i + 2]});
        for (auto k = offsets[i]; k < offsets[i + 1]; ++k) {
            const auto j = 3 * neighbours[k];
            around.emplace_back(points[j], points[j + 1], points[j + 2]);
        }
        if (around.size() < (degree + 1) * (degree + 2) / 2) continue;
        Fitting fitting;
        auto monge = fitting(around.begin(), around.end(), degree, 2);
        monge.comply_wrt_given_normal({normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]});
        // CGAL's are those of the height over the tangent plane, negative on a sphere seen from outside.
        curvatures[2 * i] = -monge.principal_curvatures(1);
        curvatures[2 * i + 1] = -monge.principal_curvatures(0);
    }
    std::ofstream out(argv[2], std::ios::binary);
    out.write(reinterpret_cast<const char *>(curvatures.data()),
              static_cast<std::streamsize>(curvatures.size() * sizeof(double)));
    return out ? 0 : 4;
}
