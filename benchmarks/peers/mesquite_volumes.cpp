// Mesquite on a mesh of tetrahedra or hexahedra: mesquite_volumes WRAPPER INPUT OUTPUT
//
// WRAPPER: ShapeImprover, ShapeImprovementWrapper or UntangleWrapper, with their defaults. INPUT: the numbers of nodes,
// of cells, and of the corners of each (4 or 8); x, y, z and 1 for a held node or 0, a node a line; the nodes of a cell,
// counted from 0, a line. OUTPUT: seconds of the
// processor for the set-up from arrays and for the smoothing; x, y and z, a node a line. It is built as
// mesquite_driver.cpp, whose first lines tell how, and named by MESQUITE_VOLUMES.

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
#include "Mesquite_UntangleWrapper.hpp"

namespace msq = MESQUITE_NS;

static double seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

int main(int count, char** words) {
    if (count != 4) {
        std::cerr << "mesquite_volumes WRAPPER INPUT OUTPUT\n";
        return 2;
    }
    std::ifstream input(words[2]);
    size_t nodes = 0, cells = 0, width = 0;
    input >> nodes >> cells >> width;
    std::vector<double> points(3 * nodes);
    std::vector<int> held(nodes);
    for (size_t k = 0; k < nodes; ++k) input >> points[3 * k] >> points[3 * k + 1] >> points[3 * k + 2] >> held[k];
    std::vector<unsigned long> corners(width * cells);
    for (unsigned long& corner : corners) input >> corner;
    if (!input) {
        std::cerr << "the input cannot be read\n";
        return 2;
    }
    const double began = seconds();
    msq::MsqError error;
    msq::ArrayMesh mesh(3, nodes, points.data(), held.data(), cells, width == 8 ? msq::HEXAHEDRON : msq::TETRAHEDRON,
                        corners.data());
    std::unique_ptr<msq::Wrapper> improver;
    if (std::string(words[1]) == "ShapeImprovementWrapper")
        improver.reset(new msq::ShapeImprovementWrapper());
    else if (std::string(words[1]) == "UntangleWrapper")
        improver.reset(new msq::UntangleWrapper());
    else
        improver.reset(new msq::ShapeImprover());
    improver->quality_assessor().disable_printing_results();
    const double ready = seconds();
    improver->run_instructions(&mesh, error);
    const double done = seconds();
    if (error) {
        std::cerr << error << "\n";
        return 1;
    }
    std::ofstream output(words[3]);
    output << std::setprecision(17) << ready - began << " " << done - ready << "\n";
    for (size_t k = 0; k < nodes; ++k)
        output << points[3 * k] << " " << points[3 * k + 1] << " " << points[3 * k + 2] << "\n";
    return output ? 0 : 1;
}
