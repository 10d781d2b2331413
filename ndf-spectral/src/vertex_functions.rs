//! Several functions on the vertices of a surface.

use std::ops::Index;

/// Functions on the vertices of a surface, one after another: V values each.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexFunctions {
    vertex_count: usize,
    count: usize,
    values: Vec<f64>,
}

impl VertexFunctions {
    /// Functions that are zero.
    pub fn zeros(vertex_count: usize, count: usize) -> Self {
        Self { vertex_count, count, values: vec![0.0; vertex_count * count] }
    }

    /// No functions, and memory for so many.
    pub(crate) fn with_capacity(vertex_count: usize, count: usize) -> Self {
        Self { vertex_count, count: 0, values: Vec::with_capacity(vertex_count * count) }
    }

    /// One more function, which is zero, to be changed.
    pub(crate) fn push(&mut self) -> &mut [f64] {
        self.count += 1;
        self.values.resize(self.count * self.vertex_count, 0.0);
        self.function_mut(self.count - 1)
    }

    /// Number of vertices V.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Number of functions.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The values of all functions, one function after another: a V × K matrix, column by column.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// A function, to be changed.
    ///
    /// # Panics
    /// If there is no such function.
    pub fn function_mut(&mut self, k: usize) -> &mut [f64] {
        assert!(k < self.count);
        &mut self.values[k * self.vertex_count..][..self.vertex_count]
    }

    /// The functions, each as its values at the vertices.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[f64]> + Clone + '_ {
        (0..self.count).map(|k| &self[k])
    }

    /// The values of all functions at a vertex, a descriptor of it.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn at_vertex(&self, vertex: usize) -> impl ExactSizeIterator<Item = f64> + Clone + '_ {
        assert!(vertex < self.vertex_count);
        (0..self.count).map(move |k| self.values[k * self.vertex_count + vertex])
    }
}

impl Index<usize> for VertexFunctions {
    type Output = [f64];

    /// The values of a function at the vertices.
    fn index(&self, k: usize) -> &[f64] {
        assert!(k < self.count, "function {k} of {}", self.count);
        &self.values[k * self.vertex_count..][..self.vertex_count]
    }
}

#[cfg(feature = "nalgebra")]
impl From<VertexFunctions> for nalgebra_sparse::na::DMatrix<f64> {
    /// A V × K matrix.
    fn from(functions: VertexFunctions) -> Self {
        Self::from_vec(functions.vertex_count, functions.count, functions.values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_columns_and_vertices_rows() {
        let mut functions = VertexFunctions::zeros(3, 2);
        functions.function_mut(1).copy_from_slice(&[1.0, 2.0, 3.0]);
        assert_eq!(functions.values(), [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
        assert_eq!(&functions[1], [1.0, 2.0, 3.0]);
        assert!(functions.at_vertex(2).eq([0.0, 3.0]));
        assert_eq!(functions.iter().map(|f| f.iter().sum::<f64>()).collect::<Vec<_>>(), [0.0, 6.0]);
        #[cfg(feature = "nalgebra")]
        {
            let matrix = nalgebra_sparse::na::DMatrix::from(functions);
            assert_eq!((matrix.shape(), matrix[(2, 1)]), ((3, 2), 3.0));
        }
    }
}
