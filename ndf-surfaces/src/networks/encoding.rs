//! Positional encodings (Mildenhall et al. 2020, Eq. 4), in the orders of the authors' codes.

use ndf_core::DVec3;

/// Sines and cosines of 2⁰ … 2^(L−1) times the coordinates; angles without a factor π. Computed in double precision:
/// the highest octave multiplies the rounding of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// x, then for every octave the three sines and the three cosines: NeRF, NeuS, IDR.
    ByOctave {
        /// L
        octaves: usize,
    },
    /// All sines, then all cosines, each by coordinate, then by octave; without x: nerfstudio, SDFStudio.
    ByCoordinate {
        /// L
        octaves: usize,
    },
}

impl Encoding {
    /// Width of the code.
    pub fn width(self) -> usize {
        match self {
            Self::ByOctave { octaves } => 3 + 6 * octaves,
            Self::ByCoordinate { octaves } => 6 * octaves,
        }
    }

    /// Column of the sine and of the cosine of an octave of a coordinate.
    fn columns(self, axis: usize, octave: usize) -> (usize, usize) {
        match self {
            Self::ByOctave { .. } => {
                let sine = 3 + 6 * octave + axis;
                (sine, sine + 3)
            }
            Self::ByCoordinate { octaves } => {
                let sine = axis * octaves + octave;
                (sine, sine + 3 * octaves)
            }
        }
    }

    /// L
    pub fn octaves(self) -> usize {
        match self {
            Self::ByOctave { octaves } | Self::ByCoordinate { octaves } => octaves,
        }
    }

    /// Writes the code of every point, by columns.
    pub(super) fn encode(self, points: &[DVec3], y: &mut [f32]) {
        let n = points.len();
        for axis in 0..3 {
            if let Self::ByOctave { .. } = self {
                let column = &mut y[axis * n..][..n];
                points.iter().zip(column).for_each(|(p, y)| *y = p[axis] as f32);
            }
            for octave in 0..self.octaves() {
                let (sine, cosine) = self.columns(axis, octave);
                let frequency = f64::from(1_u32 << octave);
                for (i, p) in points.iter().enumerate() {
                    let (s, c) = (frequency * p[axis]).sin_cos();
                    (y[sine * n + i], y[cosine * n + i]) = (s as f32, c as f32);
                }
            }
        }
    }

    /// Adds to the gradients what the adjoints of the code amount to.
    pub(super) fn pull_back(self, code: &[f32], adjoint: &[f32], gradients: &mut [DVec3]) {
        let n = gradients.len();
        for axis in 0..3 {
            if let Self::ByOctave { .. } = self {
                let column = &adjoint[axis * n..][..n];
                gradients.iter_mut().zip(column).for_each(|(g, &a)| g[axis] += f64::from(a));
            }
            for octave in 0..self.octaves() {
                let (sine, cosine) = self.columns(axis, octave);
                let frequency = f64::from(1_u32 << octave);
                for (i, g) in gradients.iter_mut().enumerate() {
                    let (s, c) = (f64::from(code[sine * n + i]), f64::from(code[cosine * n + i]));
                    let (to_sine, to_cosine) =
                        (f64::from(adjoint[sine * n + i]), f64::from(adjoint[cosine * n + i]));
                    g[axis] += frequency * (to_sine * c - to_cosine * s);
                }
            }
        }
    }
}
