// What geometry-central finds on a triangulation, and how long it takes: the peer of
// `cargo bench -p ndf-fields --bench peers -- --geometry-central PROGRAM`. The Makefile beside this file builds it.
//
// Usage: peers fields|speed FOLDER. The folder holds raw little-endian arrays of one mesh twice: as it is in space (`positions`, `faces`,
// `directions`) and as the intrinsic Delaunay triangulation (`delaunay-faces`, `-twins`, `-lengths`, `-directions`). Half-edge 3f + c
// leads from corner c of face f to the next; twins, lengths and directions are one a half-edge, the last being angles in the plane of
// the tail. Everything written is in these planes, whatever half-edge geometry-central takes for the first of a vertex.

#include "geometrycentral/numerical/linear_solvers.h"
#include "geometrycentral/surface/direction_fields.h"
#include "geometrycentral/surface/edge_length_geometry.h"
#include "geometrycentral/surface/heat_method_distance.h"
#include "geometrycentral/surface/manifold_surface_mesh.h"
#include "geometrycentral/surface/signed_heat_method.h"
#include "geometrycentral/surface/stripe_patterns.h"
#include "geometrycentral/surface/vector_heat_method.h"
#include "geometrycentral/surface/vertex_position_geometry.h"

#include <algorithm>
#include <complex>
#include <cstdint>
#include <ctime>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

using namespace geometrycentral;
using namespace geometrycentral::surface;
using Complex = std::complex<double>;

static std::string folder;

template <typename T> std::vector<T> read(const std::string& name) {
  std::ifstream file(folder + "/" + name, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error("there is no file " + name);
  std::vector<T> values(size_t(file.tellg()) / sizeof(T));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(values.data()), std::streamsize(values.size() * sizeof(T)));
  return values;
}

template <typename T> void leave(const std::string& name, const std::vector<T>& values) {
  std::ofstream file(folder + "/" + name, std::ios::binary);
  file.write(reinterpret_cast<const char*>(values.data()), std::streamsize(values.size() * sizeof(T)));
}

// A mesh, its half-edges by their numbers, and what turns vectors of geometry-central's planes into the bench's.
struct Triangulation {
  std::unique_ptr<ManifoldSurfaceMesh> mesh;
  std::unique_ptr<IntrinsicGeometryInterface> geometry;
  VertexPositionGeometry* embedded = nullptr;
  std::vector<Halfedge> halfedges;
  std::vector<Complex> turns;

  // The mesh in space.
  static Triangulation given() {
    Triangulation found;
    found.mesh = std::make_unique<ManifoldSurfaceMesh>(polygons("faces"));
    auto numbers = read<double>("positions");
    VertexData<Vector3> positions(*found.mesh);
    for (Vertex v : found.mesh->vertices()) {
      const double* at = &numbers[3 * v.getIndex()];
      positions[v] = Vector3{at[0], at[1], at[2]};
    }
    auto geometry = std::make_unique<VertexPositionGeometry>(*found.mesh, positions);
    found.embedded = geometry.get();
    found.geometry = std::move(geometry);
    found.number("directions");
    return found;
  }

  // The intrinsic Delaunay triangulation.
  static Triangulation delaunay() {
    Triangulation found;
    auto faces = polygons("delaunay-faces");
    auto numbers = read<uint32_t>("delaunay-twins");
    std::vector<std::vector<std::tuple<size_t, size_t>>> twins(faces.size());
    for (size_t h = 0; h < numbers.size(); h++) {
      bool isBoundary = numbers[h] == UINT32_MAX;
      twins[h / 3].emplace_back(isBoundary ? INVALID_IND : numbers[h] / 3, isBoundary ? INVALID_IND : numbers[h] % 3);
    }
    found.mesh = std::make_unique<ManifoldSurfaceMesh>(faces, twins);
    auto sides = read<double>("delaunay-lengths");
    EdgeData<double> lengths(*found.mesh);
    found.collect();
    for (size_t h = 0; h < sides.size(); h++) lengths[found.halfedges[h].edge()] = sides[h];
    found.geometry = std::make_unique<EdgeLengthGeometry>(*found.mesh, lengths);
    found.number("delaunay-directions");
    return found;
  }

  // Numbers in the bench's planes of numbers in geometry-central's, which are powers.
  template <typename F> void leavePowers(const std::string& name, int power, F value) const {
    std::vector<Complex> values;
    for (Vertex v : mesh->vertices()) values.push_back(Complex(value(v)) * std::pow(turns[v.getIndex()], power));
    leave(name, values);
  }

private:
  static std::vector<std::vector<size_t>> polygons(const std::string& name) {
    auto corners = read<uint32_t>(name);
    std::vector<std::vector<size_t>> faces(corners.size() / 3);
    for (size_t c = 0; c < corners.size(); c++) faces[c / 3].push_back(corners[c]);
    return faces;
  }

  void collect() {
    for (Face f : mesh->faces()) {
      for (Halfedge h : f.adjacentHalfedges()) halfedges.push_back(h);
    }
  }

  void number(const std::string& name) {
    halfedges.clear();
    collect();
    auto directions = read<double>(name);
    geometry->requireHalfedgeVectorsInVertex();
    turns.assign(mesh->nVertices(), 0.);
    for (size_t h = 0; h < halfedges.size(); h++) {
      Complex theirs = geometry->halfedgeVectorsInVertex[halfedges[h]];
      turns[halfedges[h].vertex().getIndex()] = std::polar(1., directions[h] - std::arg(theirs));
    }
  }
};

// The connection Laplacian that computeSmoothestVertexDirectionField minimises.
SparseMatrix<Complex> connectionLaplacian(const Triangulation& on, int symmetry) {
  IntrinsicGeometryInterface& geometry = *on.geometry;
  geometry.requireEdgeCotanWeights();
  geometry.requireTransportVectorsAlongHalfedge();
  std::vector<Eigen::Triplet<Complex>> entries;
  for (Halfedge h : on.mesh->halfedges()) {
    size_t tail = h.tailVertex().getIndex(), tip = h.tipVertex().getIndex();
    double weight = geometry.edgeCotanWeights[h.edge()];
    Complex back = geometry.transportVectorsAlongHalfedge[h.twin()].pow(symmetry);
    entries.emplace_back(tail, tail, weight);
    entries.emplace_back(tail, tip, -weight * back);
  }
  SparseMatrix<Complex> matrix(on.mesh->nVertices(), on.mesh->nVertices());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

std::vector<int32_t> numbers(const FaceData<int>& indices) {
  std::vector<int32_t> found;
  for (Face f : indices.getMesh()->faces()) found.push_back(indices[f]);
  return found;
}

void fields() {
  Triangulation delaunay = Triangulation::delaunay();
  IntrinsicGeometryInterface& geometry = *delaunay.geometry;
  geometry.requireVertexGalerkinMassMatrix();
  geometry.requireVertexLumpedMassMatrix();
  for (int n : {1, 2, 4}) {
    std::string end = "-" + std::to_string(n);
    VertexData<Vector2> field = computeSmoothestVertexDirectionField(geometry, n);
    delaunay.leavePowers("smoothest" + end, n, [&](Vertex v) { return field[v]; });
    leave("smoothest-indices" + end, numbers(computeFaceIndex(geometry, field, n)));
    // The vectors before they are made unit: with the mass of geometry-central, and with the bench's.
    SparseMatrix<Complex> energy = connectionLaplacian(delaunay, n);
    SparseMatrix<Complex> shifted = energy + 1e-9 * identityMatrix<Complex>(energy.rows());
    for (std::string mass : {"consistent", "lumped"}) {
      auto& matrix = mass == "lumped" ? geometry.vertexLumpedMassMatrix : geometry.vertexGalerkinMassMatrix;
      SparseMatrix<Complex> masses = matrix.cast<Complex>();
      Vector<Complex> x = smallestEigenvectorSquare(shifted, masses);
      delaunay.leavePowers(mass + end, n, [&](Vertex v) { return x[v.getIndex()]; });
      leave(mass + "-energy" + end, std::vector<double>{x.dot(energy * x).real() / x.dot(masses * x).real()});
    }
  }

  auto powers = read<Complex>("lines");
  VertexData<Vector2> lines(*delaunay.mesh);
  for (Vertex v : delaunay.mesh->vertices()) {
    lines[v] = Vector2::fromComplex(powers[v.getIndex()] / std::pow(delaunay.turns[v.getIndex()], 2));
  }
  VertexData<double> frequencies(*delaunay.mesh, read<double>("frequency")[0]);
  auto [phases, branches, singular] = computeStripePattern(geometry, frequencies, lines);
  std::vector<double> corners;
  for (Halfedge h : delaunay.halfedges) corners.push_back(phases[h.corner()]);
  leave("stripe-corners", corners);
  leave("stripe-branches", numbers(branches));
  leave("stripe-singular", numbers(singular));

  // Curvature needs the mesh in space. Its load is the right-hand side that computeCurvatureAlignedVertexDirectionField makes of it.
  Triangulation given = Triangulation::given();
  VertexPositionGeometry& embedded = *given.embedded;
  embedded.requireVertexPrincipalCurvatureDirections();
  embedded.requireVertexGalerkinMassMatrix();
  given.leavePowers("principal", 2, [&](Vertex v) { return embedded.vertexPrincipalCurvatureDirections[v]; });
  for (int n : {2, 4}) {
    std::string end = "-" + std::to_string(n);
    VertexData<Vector2> field = computeCurvatureAlignedVertexDirectionField(embedded, n);
    given.leavePowers("curvature" + end, n, [&](Vertex v) { return field[v]; });
    leave("curvature-indices" + end, numbers(computeFaceIndex(embedded, field, n)));
    Vector<Complex> powers(given.mesh->nVertices());
    for (Vertex v : given.mesh->vertices()) {
      powers[v.getIndex()] = Complex(embedded.vertexPrincipalCurvatureDirections[v].pow(n / 2));
    }
    Vector<Complex> load = embedded.vertexGalerkinMassMatrix.cast<Complex>() * powers;
    given.leavePowers("curvature-load" + end, n, [&](Vertex v) { return load[v.getIndex()]; });
  }
}

template <typename F> double seconds(F work) {
  std::clock_t start = std::clock();
  work();
  return double(std::clock() - start) / CLOCKS_PER_SEC;
}

// The median of three.
template <typename F> double again(F work) {
  std::vector<double> times;
  for (int turn = 0; turn < 3; turn++) times.push_back(seconds(work));
  std::sort(times.begin(), times.end());
  return times[1];
}

// Times in the order of the bench's rows. Distances flip to Delaunay themselves; the rest begins with the Delaunay triangulation, whose
// flips it does not count.
void speed() {
  Triangulation given = Triangulation::given(), delaunay = Triangulation::delaunay();
  IntrinsicGeometryInterface& geometry = *delaunay.geometry;
  uint32_t source = read<uint32_t>("source")[0];
  std::vector<double> times;

  std::unique_ptr<HeatMethodDistanceSolver> heat;
  times.push_back(seconds([&] { heat.reset(new HeatMethodDistanceSolver(*given.geometry, 1., true)); }));
  times.push_back(again([&] { heat->computeDistance(given.mesh->vertex(source)); }));

  Vertex from = delaunay.mesh->vertex(source);
  std::vector<std::tuple<Vertex, double>> two{{from, 1.}, {delaunay.mesh->vertex(delaunay.mesh->nVertices() - 1), 3.}};
  std::unique_ptr<VectorHeatMethodSolver> vectors;
  auto transport = [&] { vectors->transportTangentVector(from, Vector2{1., 0.}); };
  auto logarithm = [&] { vectors->computeLogMap(from, LogMapStrategy::VectorHeat); };
  // Matrices are factored when they are first needed.
  double cold = seconds([&] {
    vectors.reset(new VectorHeatMethodSolver(geometry));
    transport();
    logarithm();
  });
  double transported = again(transport), mapped = again(logarithm);
  times.push_back(cold - transported - mapped);
  times.push_back(transported);
  times.push_back(again([&] { vectors->extendScalar(two); }));
  times.push_back(mapped);

  std::vector<Curve> curves;
  auto ends = read<uint32_t>("curves");
  for (size_t c = 0; c < ends.size(); c += 2) {
    curves.push_back(Curve{{given.mesh->vertex(ends[c]), given.mesh->vertex(ends[c + 1])}, true});
  }
  times.push_back(seconds([&] { SignedHeatSolver(*given.geometry).computeDistance(curves); }));

  VertexData<Vector2> lines;
  times.push_back(seconds([&] { lines = computeSmoothestVertexDirectionField(geometry, 2); }));
  VertexData<double> frequencies(*delaunay.mesh, read<double>("frequency")[0]);
  times.push_back(seconds([&] { computeStripePattern(geometry, frequencies, lines); }));
  leave("seconds", times);
}

int main(int count, char** arguments) {
  std::string what = count == 3 ? arguments[1] : "";
  if (what != "fields" && what != "speed") {
    std::cerr << "usage: peers fields|speed FOLDER" << std::endl;
    return 2;
  }
  folder = arguments[2];
  try {
    what == "fields" ? fields() : speed();
  } catch (const std::exception& error) {
    std::cerr << error.what() << std::endl;
    return 1;
  }
}
