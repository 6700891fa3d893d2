// Mesquite on a planar mesh of triangles and quads: mesquite_driver WRAPPER CALLS INPUT OUTPUT
//
// WRAPPER: ShapeImprover or ShapeImprovementWrapper, with its defaults. CALLS: how often it runs, each time from where
// it came to. INPUT: the numbers of nodes, triangles and quads; x, y and 1 for a held node or 0, a node a line; three
// or four nodes, counted from 0, a cell a line, triangles first. OUTPUT: seconds of the processor for the set-up from
// arrays and for the smoothing; x and y, a node a line.
//
// How it is built, from the sources of github.com/trilinos/mesquite (2.99, LGPL 2.1) in the folder mesquite:
//
//     printf 'macro(TRIBITS_EXCLUDE_FILES)\nendmacro()\nmacro(TRIBITS_PACKAGE_POSTPROCESS)\nendmacro()\n' > stubs.cmake
//     cmake -S mesquite -B built -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS="-std=c++11 -w -fpermissive" \
//         -DCMAKE_PROJECT_INCLUDE=$PWD/stubs.cmake
//     make -C built mesquite
//     g++ -O3 -std=c++11 -w -fpermissive $(find mesquite/src built/src -type d | sed s/^/-I/) \
//         benchmarks/peers/mesquite_driver.cpp built/src/libmesquite.a -o mesquite_driver
//     export MESQUITE_DRIVER=$PWD/mesquite_driver

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "Mesquite_ArrayMesh.hpp"
#include "Mesquite_MsqError.hpp"
#include "Mesquite_QualityAssessor.hpp"
#include "Mesquite_ShapeImprovementWrapper.hpp"
#include "Mesquite_ShapeImprover.hpp"
#include "Mesquite_XYPlanarDomain.hpp"

namespace msq = MESQUITE_NS;

static std::unique_ptr<msq::Wrapper> wrapper(const std::string& name) {
    if (name == "ShapeImprover") return std::unique_ptr<msq::Wrapper>(new msq::ShapeImprover);
    if (name == "ShapeImprovementWrapper") return std::unique_ptr<msq::Wrapper>(new msq::ShapeImprovementWrapper);
    return nullptr;
}

static double seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

int main(int count, char** words) {
    if (count != 5) {
        std::cerr << "mesquite_driver WRAPPER CALLS INPUT OUTPUT\n";
        return 2;
    }
    std::ifstream input(words[3]);
    size_t nodes = 0, kinds[2] = {0, 0};
    input >> nodes >> kinds[0] >> kinds[1];
    std::vector<double> points(3 * nodes, 0.0);
    std::vector<int> held(nodes);
    for (size_t k = 0; k < nodes; ++k) input >> points[3 * k] >> points[3 * k + 1] >> held[k];
    std::vector<unsigned long> corners(3 * kinds[0] + 4 * kinds[1]), starts(1, 0);
    for (unsigned long& corner : corners) input >> corner;
    if (!input) {
        std::cerr << "the input cannot be read\n";
        return 2;
    }
    std::vector<msq::EntityTopology> types(kinds[0], msq::TRIANGLE);
    types.resize(kinds[0] + kinds[1], msq::QUADRILATERAL);
    for (msq::EntityTopology type : types) starts.push_back(starts.back() + (type == msq::TRIANGLE ? 3 : 4));

    const double began = seconds();
    msq::MsqError error;
    msq::ArrayMesh mesh(3, nodes, points.data(), held.data(), types.size(), types.data(), corners.data(),
                        starts.data());
    msq::XYPlanarDomain plane;  // of all planes the only one that feasible Newton takes
    msq::MeshDomainAssoc both(&mesh, &plane);
    std::unique_ptr<msq::Wrapper> improver = wrapper(words[1]);
    if (!improver) {
        std::cerr << "there is no wrapper " << words[1] << "\n";
        return 2;
    }
    improver->quality_assessor().disable_printing_results();
    const double ready = seconds();
    for (int call = 0; call < std::atoi(words[2]) && !error; ++call) improver->run_instructions(&both, error);
    const double done = seconds();
    if (error) {
        std::cerr << error << "\n";
        return 1;
    }
    std::ofstream output(words[4]);
    output << std::setprecision(17) << ready - began << " " << done - ready << "\n";
    for (size_t k = 0; k < nodes; ++k) output << points[3 * k] << " " << points[3 * k + 1] << "\n";
    return output ? 0 : 1;
}
