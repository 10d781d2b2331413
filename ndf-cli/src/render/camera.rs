//! Where a picture is taken from.

use ndf_core::DVec3;

/// Half the angle of view along the shorter side of the picture: mild perspective.
const HALF_ANGLE_DEGREES: f64 = 12.0;

/// Share of the picture left free on every side.
const MARGIN: f64 = 0.04;

/// The direction that points up in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Up {
    /// The x axis.
    X,
    /// The y axis, as in most scanned models.
    #[default]
    Y,
    /// The z axis, as in most CAD models and captured scenes.
    Z,
    /// Against the x axis.
    #[value(name = "-x")]
    MinusX,
    /// Against the y axis, as in scenes of COLMAP.
    #[value(name = "-y")]
    MinusY,
    /// Against the z axis.
    #[value(name = "-z")]
    MinusZ,
}

impl Up {
    /// Its name in arguments.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::MinusX => "-x",
            Self::MinusY => "-y",
            Self::MinusZ => "-z",
        }
    }

    /// The number of the axis, and whether up is against it.
    fn axis(self) -> (usize, bool) {
        match self {
            Self::X => (0, false),
            Self::Y => (1, false),
            Self::Z => (2, false),
            Self::MinusX => (0, true),
            Self::MinusY => (1, true),
            Self::MinusZ => (2, true),
        }
    }
}

impl std::fmt::Display for Up {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (axis, is_against) = self.axis();
        write!(f, "{}{}", if is_against { "-" } else { "" }, ["x", "y", "z"][axis])
    }
}

/// The side a mesh is seen from, in degrees. At yaw 0 the camera looks against the axis after the one that
/// points up (z if y is up); growing yaw takes it to the right around the mesh, growing pitch upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Angle around the axis that points up.
    pub yaw: f64,
    /// Angle above the horizon.
    pub pitch: f64,
    /// What is up.
    pub up: Up,
}

impl Default for View {
    fn default() -> Self {
        Self { yaw: 30.0, pitch: 20.0, up: Up::Y }
    }
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Size of a pixel at distance 1.
    spread: f64,
    width: usize,
    height: usize,
}

impl Camera {
    /// A camera that sees all of `points` as large as the picture allows. Points that are not finite are
    /// ignored. O(n).
    ///
    /// # Panics
    /// If the picture has no pixel.
    pub fn framing(points: &[DVec3], view: View, width: usize, height: usize) -> Self {
        assert!(width > 0 && height > 0, "the picture has no pixel");
        let (yaw, pitch) = (view.yaw.to_radians(), view.pitch.to_radians());
        let (axis, is_against) = view.up.axis();
        // Back, right and up of a camera at yaw and pitch 0 follow each other as the axes do.
        let [up, back, right] = [0, 1, 2].map(|k| DVec3::AXES[(axis + k) % 3]);
        let (up, right) = if is_against { (-up, -right) } else { (up, right) };
        let (sideways, ahead) = (right * yaw.cos() - back * yaw.sin(), back * yaw.cos() + right * yaw.sin());
        let backward = ahead * pitch.cos() + up * pitch.sin();
        let (right, up, forward) = (sideways, backward.cross(sideways), -backward);
        let half = HALF_ANGLE_DEGREES.to_radians().tan();
        let spread = 2.0 * half / width.min(height) as f64;
        let mut camera = Self { eye: DVec3::ZERO, right, up, forward, spread, width, height };
        camera.frame(points);
        camera
    }

    fn frame(&mut self, points: &[DVec3]) {
        let seen = |p: DVec3| DVec3::new(p.dot(self.right), p.dot(self.up), -p.dot(self.forward));
        let points: Vec<DVec3> = points.iter().filter(|p| p.is_finite()).map(|&p| seen(p)).collect();
        let bounds = ndf_core::BoundingBox::of_points(&points);
        if bounds.is_empty() {
            self.eye = -self.forward;
            return;
        }
        let room = 0.5 * self.spread * (1.0 - 2.0 * MARGIN);
        let (across, upward) = (room * self.width as f64, room * self.height as f64);
        let mut target = bounds.center();
        let mut distance = 0.0;
        for _ in 0..8 {
            distance = points
                .iter()
                .map(|&p| p - target)
                .map(|p| p.z + (p.x.abs() / across).max(p.y.abs() / upward))
                .fold(0.0, f64::max)
                .max(1e-6 * bounds.diagonal())
                .max(f64::MIN_POSITIVE);
            // Nearer parts look larger: the middle of the picture is not that of the box.
            let mut low = DVec3::INFINITY;
            let mut high = DVec3::NEG_INFINITY;
            for p in points.iter().map(|&p| p - target) {
                let p = p * DVec3::new(1.0, 1.0, 0.0) / (distance - p.z).max(1e-3 * distance);
                (low, high) = (low.min(p), high.max(p));
            }
            target += 0.5 * (low + high) * distance;
        }
        self.eye = self.right * target.x + self.up * target.y - self.forward * (target.z + distance);
    }

    /// Pixels in a row, and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Where it stands.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Unit vector it looks along.
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// Unit vector to the right of the picture.
    pub fn right(&self) -> DVec3 {
        self.right
    }

    /// Unit vector to the top of the picture.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Unit direction towards a place of the picture, in pixels from its upper left corner.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let (x, y) = (x - 0.5 * self.width as f64, 0.5 * self.height as f64 - y);
        (self.forward + self.spread * (x * self.right + y * self.up)).normalize()
    }

    /// Length that a pixel covers at a distance from the eye.
    pub fn pixel_size(&self, distance: f64) -> f64 {
        distance * self.spread
    }
}
