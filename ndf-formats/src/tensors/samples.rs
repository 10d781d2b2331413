//! Small files of tensors, made by code: for tests, and as seeds of fuzzers.

use super::made::Torus;
use super::{Tensor, to_safetensors};

/// An array of NumPy's in row-major order: its kind and shape as NumPy writes them.
pub fn npy(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    npy_in_order(kind, "False", shape, data)
}

/// The same in either order; `True` is by columns.
pub fn npy_in_order(kind: &str, by_columns: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{kind}', 'fortran_order': {by_columns}, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

/// Bytes of numbers.
pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A zip archive.
pub fn zip_of(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, contents) in entries {
        let options =
            zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        zip.start_file(*name, options).expect("memory can be written to");
        std::io::Write::write_all(&mut zip, contents).expect("memory can be written to");
    }
    zip.finish().expect("memory can be written to").into_inner()
}

/// A pickle of `{'w': tensor}`, the tensor a 2 × 3 view, with these strides, of a storage of six floats called `0`.
pub fn torch_pickle(strides: [u8; 2]) -> Vec<u8> {
    let mut p = b"\x80\x02}X\x01\x00\x00\x00wctorch._utils\n_rebuild_tensor_v2\n((".to_vec();
    p.extend(b"X\x07\x00\x00\x00storagectorch\nFloatStorage\nX\x01\x00\x00\x000X\x03\x00\x00\x00cpuK\x06tQ");
    p.extend(b"K\x00K\x02K\x03\x86");
    p.extend([b'K', strides[0], b'K', strides[1], 0x86]);
    p.extend(b"\x89ccollections\nOrderedDict\n)RtRs.");
    p
}

/// A file of the format before PyTorch 1.6 with the tensor of [`torch_pickle`].
pub fn torch_legacy() -> Vec<u8> {
    let mut bytes = b"\x80\x02\x8a\x0al\xfc\x9cF\xf9 j\xa8P\x19.\x80\x02M\xe9\x03.\x80\x02}q\x00.".to_vec();
    bytes.extend(torch_pickle([3, 1]));
    bytes.extend(b"\x80\x02]X\x01\x00\x00\x000a.");
    bytes.extend(6_u64.to_le_bytes());
    bytes.extend(floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    bytes
}

/// A Keras model of one layer.
pub fn keras() -> Vec<u8> {
    let mut file = hdf5_pure::FileBuilder::new();
    let mut group = file.create_group("dense");
    group.create_dataset("kernel:0").with_f32_data(&[1.0, 2.0, 3.0]).with_shape(&[3, 1]);
    group.create_dataset("bias:0").with_f32_data(&[-0.5]).with_shape(&[1]);
    file.add_group(group.finish());
    file.finish().expect("the file is small")
}

/// A file of every container, with the end of its name.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    let six = floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let list: &[u8] = b"\x80\x02]cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85U\x01b\x87R\
        (K\x01K\x03\x85cnumpy\ndtype\nX\x02\x00\x00\x00f4K\x00K\x01\x87R\x89U\x0c\x00\x00\x80?\x00\x00\x00@\x00\x00@@tba.";
    let torus = Torus { ring: 0.5, tube: 0.2 };
    let few: Vec<(String, Tensor)> =
        torus.as_neus().into_iter().filter(|(name, _)| name.ends_with("bias")).collect();
    vec![
        ("six.npy", npy("<f4", "(2, 3)", &six)),
        ("objects.npy", npy("|O", "(1,)", list)),
        (
            "six.npz",
            zip_of(&[
                ("0000.dense.A.npy", &npy("<f4", "(3, 2)", &six)),
                ("0000.dense.b.npy", &npy("<f4", "(2,)", &six[..8])),
            ]),
        ),
        ("zip.pth", zip_of(&[("a/data.pkl", &torch_pickle([3, 1])), ("a/data/0", &six)])),
        ("legacy.pth", torch_legacy()),
        ("keras.h5", keras()),
        ("few.safetensors", to_safetensors(&few).expect("names are plain")),
    ]
}
