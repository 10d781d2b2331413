//! Distances at any point, from the windows that were kept.

use ndf_mesh::NO_HALFEDGE;
use ndf_mesh::{FacePoint, Halfedge, SurfacePoint, Vertex};

use crate::error::GeodesicError;
use crate::exact::Geodesics;
use crate::pseudo_sources::Arrival;
use crate::sources::{Place, above, corner_distance, distance_in_face};
use crate::unfolding::Layout;
use crate::windows::{TIE, Window};

/// The last straight piece of a shortest path to a point.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Piece {
    /// Through a window of this half-edge, which enters the point's face, at this length from its tail.
    Window { halfedge: Halfedge, window: Window, crossing: f64 },
    /// From a vertex of the point's face, straight through the face or along an edge.
    Vertex(Vertex),
    /// From the source of this number, in the point's face.
    Source(u32),
}

/// The shortest piece found yet, and the distance it gives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) distance: f64,
    pub(crate) piece: Option<Piece>,
}

impl Nearest {
    pub(crate) const NONE: Self = Self { distance: f64::INFINITY, piece: None };

    pub(crate) fn offer(&mut self, distance: f64, piece: Piece) {
        if distance < self.distance {
            *self = Self { distance, piece: Some(piece) };
        }
    }
}

impl Geodesics<'_> {
    /// Distance of any point of the mesh from its nearest source; +∞ where none reaches, and beyond the
    /// radius or the targets at which the computation stopped. Exact, from the windows on the sides of the
    /// point's face; O(their number).
    ///
    /// # Errors
    /// If the windows were not [kept](crate::ExactOptions::keep_windows) or the point is not on the mesh.
    pub fn distance_at(&self, point: SurfacePoint) -> Result<f64, GeodesicError> {
        let place = Place::of(self.mesh, point)?;
        let distance = match place {
            Place::Vertex(v) => self.distances[v.index()],
            Place::Face(_) if self.windows.is_empty() => return Err(GeodesicError::WindowsNotKept),
            Place::Face(p) => self.nearest_in_face(&p).distance,
        };
        Ok(if distance <= self.bound { distance } else { f64::INFINITY })
    }

    pub(crate) fn nearest_in_face(&self, point: &FacePoint) -> Nearest {
        let mut nearest = Nearest::NONE;
        self.offer_sources(point, &mut nearest);
        for side in 0..3 {
            let corner = self.mesh.tail(point.face.halfedge(side));
            let distance = self.distances[corner.index()] + corner_distance(self.mesh, point, side);
            nearest.offer(distance, Piece::Vertex(corner));
        }
        for side in 0..3 {
            let halfedge = point.face.halfedge(side);
            let at = above(point, &Layout::of(self.mesh, halfedge), side);
            self.offer_windows(halfedge, at, &mut nearest);
        }
        nearest
    }

    /// The last piece of the path to a vertex that is no source: through the face and side its distance came
    /// by. Going back by arrivals ends, also over edges without length, as every arrival was settled before
    /// the next.
    pub(crate) fn nearest_to_vertex(&self, vertex: Vertex) -> Nearest {
        let mesh = self.mesh;
        let mut nearest = Nearest::NONE;
        let Arrival { halfedge, crossing, .. } = self.arrivals[vertex.index()];
        if halfedge == NO_HALFEDGE {
            return nearest;
        }
        let distance = self.distances[vertex.index()];
        for (end, side, at) in [
            (mesh.tail(halfedge), halfedge.previous(), 0.0),
            (mesh.tip(halfedge), halfedge.next(), mesh.halfedge_length(halfedge)),
        ] {
            let along = self.distances[end.index()] + mesh.halfedge_length(side);
            if crossing == at && along <= distance * (1.0 + TIE) {
                nearest.offer(along, Piece::Vertex(end));
                return nearest;
            }
        }
        let apex = halfedge.previous();
        self.offer_sources(&FacePoint::at_corner(apex), &mut nearest);
        self.offer_windows(halfedge, Layout::of(mesh, halfedge).apex, &mut nearest);
        nearest
    }

    fn offer_sources(&self, point: &FacePoint, nearest: &mut Nearest) {
        for (number, source) in self.sources.iter().enumerate() {
            if let Place::Face(source) = source
                && source.face == point.face
            {
                nearest.offer(distance_in_face(self.mesh, point, source), Piece::Source(number as u32));
            }
        }
    }

    fn offer_windows(&self, halfedge: Halfedge, [x, y]: [f64; 2], nearest: &mut Nearest) {
        for window in &self.windows[halfedge.index()] {
            let (distance, crossing) = window.reach(x, y);
            nearest.offer(distance, Piece::Window { halfedge, window: *window, crossing });
        }
    }
}
