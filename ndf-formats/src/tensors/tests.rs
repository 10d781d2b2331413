//! Every container, whole and damaged.

#![cfg(feature = "full")]

use super::samples::{floats, npy, npy_in_order, torch_pickle, zip_of};
use super::*;
use ndf_testing::data_file;

const SIX: [f32; 6] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];

fn error(bytes: &[u8]) -> String {
    TensorFile::parse(bytes).unwrap_err().to_string()
}

#[test]
fn arrays_of_all_kinds_and_orders() {
    let read = |bytes: &[u8]| TensorFile::parse(bytes).unwrap().get("array").unwrap().clone();
    let expected = Tensor::new(vec![2, 3], SIX.to_vec()).unwrap();
    assert_eq!(read(&npy("<f4", "(2, 3)", &floats(&SIX))), expected);
    let doubles: Vec<u8> = SIX.iter().flat_map(|&x| f64::from(x).to_be_bytes()).collect();
    assert_eq!(read(&npy(">f8", "(2, 3)", &doubles)), expected);
    let halves: Vec<u8> = SIX.iter().flat_map(|&x| half::f16::from_f32(x).to_le_bytes()).collect();
    assert_eq!(read(&npy("<f2", "(2, 3)", &halves)), expected);
    assert_eq!(read(&npy("|u1", "(2, 3)", &[1, 2, 3, 4, 5, 6])), expected);
    let by_columns = floats(&[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
    assert_eq!(read(&npy_in_order("<f4", "True", "(2, 3)", &by_columns)), expected);
    assert_eq!(read(&npy("<f4", "()", &floats(&[7.0]))).values(), [7.0]);
    assert!(error(&npy("<c8", "(1,)", &[0; 8])).contains("<c8"));
    assert!(error(&npy("<f4", "(2, 3)", &floats(&SIX[..5]))).contains("cut off"));
    assert!(error(&npy("<f4", "(99999999999, 99999999999)", &floats(&SIX))).contains("cut off"));
    assert!(error(b"\x93NUMPY\x01\x00\xff\xff{").contains("header"));
}

#[test]
fn archives_of_arrays() {
    let array = npy("<f4", "(6,)", &floats(&SIX));
    let file = TensorFile::parse(&zip_of(&[("0000.dense.A.npy", &array), ("notes.txt", b"hello")])).unwrap();
    assert_eq!(file.container(), Container::Npz);
    assert_eq!(file.get("0000.dense.A").unwrap().shape(), [6]);
    assert!(error(&zip_of(&[("notes.txt", b"hello")])).contains("no tensors"));
}

/// No entry is too large for the archive, but all of them together are: they might share their bytes in the file.
#[test]
fn entries_together_may_not_grow_without_end() {
    use std::io::Write;
    let zeros = npy("<f4", "(25000,)", &[0; 100_000]);
    let archive = |entries: usize| {
        let options = zip::write::SimpleFileOptions::default();
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for k in 0..entries {
            let deflated = options.compression_method(zip::CompressionMethod::Deflated);
            zip.start_file(format!("{k}.npy"), deflated).unwrap();
            zip.write_all(&zeros).unwrap();
        }
        // What does not shrink.
        zip.start_file("noise", options.compression_method(zip::CompressionMethod::Stored)).unwrap();
        zip.write_all(&[7; 5_000]).unwrap();
        zip.finish().unwrap().into_inner()
    };
    assert_eq!(TensorFile::parse(&archive(3)).unwrap().get("2").unwrap().shape(), [25_000]);
    assert!(error(&archive(200)).contains("too many for the size of the file"));
}

#[test]
fn torch_archives_with_any_strides() {
    let archive = |pickle: &[u8]| zip_of(&[("model/data.pkl", pickle), ("model/data/0", &floats(&SIX))]);
    let file = TensorFile::parse(&archive(&torch_pickle([3, 1]))).unwrap();
    assert_eq!((file.container(), file.get("w").unwrap().values()), (Container::TorchZip, &SIX[..]));
    let turned = TensorFile::parse(&archive(&torch_pickle([1, 2]))).unwrap();
    assert_eq!(turned.get("w").unwrap().values(), [1.0, 3.0, 5.0, 2.0, 4.0, 6.0]);
    assert!(error(&archive(&torch_pickle([200, 1]))).contains("beyond its storage"));
    assert!(error(&zip_of(&[("model/data.pkl", &torch_pickle([3, 1]))])).contains("data/0"));
}

#[test]
fn foreign_classes_are_not_run_and_are_named() {
    // os.system('true'), then a dictionary without tensors.
    let attack = b"\x80\x02cos\nsystem\nX\x04\x00\x00\x00true\x85R0}.";
    let refused = error(&zip_of(&[("a/data.pkl", attack)]));
    assert!(refused.contains("os.system") && refused.contains("not run"), "{refused}");
    // Beside tensors they do no harm.
    let mut mixed = b"\x80\x02cbuiltins\neval\nX\x01\x00\x00\x001\x85R0".to_vec();
    mixed.extend(&torch_pickle([3, 1])[2..]);
    let file = TensorFile::parse(&zip_of(&[("a/data.pkl", &mixed), ("a/data/0", &floats(&SIX))])).unwrap();
    assert_eq!((file.foreign(), file.get("w").is_some()), (&["builtins.eval".to_owned()][..], true));
}

#[test]
fn malformed_pickles_are_refused() {
    let of = |pickle: &[u8]| error(&zip_of(&[("a/data.pkl", pickle)]));
    assert!(of(b"\x80\x02").contains("cut off"));
    assert!(of(b"\x80\x02\xfe.").contains("0xfe"));
    assert!(of(b"\x80\x02R.").contains("inconsistent"));
    assert!(of(b"\x80\x02X\xff\xff\xff\xffabc.").contains("cut off"));
    assert!(of(b"\x80\x04\x8d\xff\xff\xff\xff\xff\xff\xff\xffabc.").contains("cut off"));
    // Thirty lists, each holding the last one twice, and a list that holds itself.
    let mut bomb = b"\x80\x02]q\x00".to_vec();
    for i in 0..30_u8 {
        bomb.extend([b']', b'q', i + 1, b'(', b'h', i, b'h', i, b'e']);
    }
    bomb.push(b'.');
    assert!(of(&bomb).contains("too many"));
    assert!(of(b"\x80\x02]q\x00h\x00a.").contains("no tensors"));
}

/// A length of 379 begins with the byte of a brace, as JSON does.
#[test]
fn safetensors_are_no_json_whatever_their_length() {
    let header = r#"{"a":{"dtype":"F32","shape":[2,3],"data_offsets":[0,24]}}"#;
    let bytes = [&379_u64.to_le_bytes()[..], format!("{header:<379}").as_bytes(), &floats(&SIX)].concat();
    assert!(bytes.starts_with(b"{"));
    assert_eq!(crate::sniff(&bytes), Some(crate::Format::Tensors(Container::Safetensors)));
    assert_eq!(TensorFile::parse(&bytes).unwrap().get("a").unwrap().shape(), [2, 3]);
}

#[test]
fn safetensors_whole_and_damaged() {
    let header = br#"{"a":{"dtype":"F32","shape":[2,3],"data_offsets":[0,24]}}"#;
    let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
    bytes.extend(header);
    bytes.extend(floats(&SIX));
    let file = TensorFile::parse(&bytes).unwrap();
    assert_eq!((file.container(), file.get("a").unwrap().values()), (Container::Safetensors, &SIX[..]));
    for end in 0..bytes.len() {
        assert!(TensorFile::parse(&bytes[..end]).is_err());
    }
}

#[test]
fn what_is_no_tensor_file_is_told() {
    for bytes in [&b""[..], b"hello, world, how are you", b"ply\nformat ascii 1.0\n", &[0; 64]] {
        assert!(matches!(TensorFile::parse(bytes), Err(TensorError::Magic)), "{bytes:?}");
        assert!(!is_tensor_file(bytes));
    }
    assert!(error(b"PK\x03\x04 and nothing more").contains("zip"));
    assert!(error(b"\x89HDF\r\n\x1a\n and nothing more").contains("HDF5"));
    assert!(
        error(&[0x80, 2, 0x8a, 10, 0x6c, 0xfc, 0x9c, 0x46, 0xf9, 0x20, 0x6a, 0xa8, 0x50, 0x19])
            .contains("cut off")
    );
}

#[test]
fn samples_of_every_container_are_read_and_survived_damaged() {
    for (name, whole) in samples::all() {
        let file = TensorFile::parse(&whole).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(file.iter().count() > 0, "{name}");
        for end in 0..whole.len() {
            let _ = TensorFile::parse(&whole[..end]);
        }
        for k in 0..8 * whole.len().min(2000) {
            let mut changed = whole.clone();
            changed[k / 8] ^= 1 << (k % 8);
            let _ = TensorFile::parse(&changed);
        }
    }
    let objects = samples::all().swap_remove(1).1;
    assert_eq!(TensorFile::parse(&objects).unwrap().get("0").unwrap().values(), [1.0, 2.0, 3.0]);
}

/// Every container people have, cut off at many places and with bytes changed: an error or tensors, never a panic.
#[test]
fn damaged_real_files_are_survived() {
    let files = [
        "nsdf/maurock_deepsdf_results.npy",
        "nsdf/nmwsharp_bunny.npz",
        "nsdf/thingi10k_h5/112932_sf.h5",
        "nerf/krrish94_ship-lowres_125000.ckpt",
        "nsdf/maurock_deepsdf_weights.pt",
    ];
    for name in files {
        let Some(whole) = data_file(name) else { continue };
        let file = TensorFile::parse(&whole).unwrap();
        assert!(file.iter().all(|(_, t)| t.values().len() == t.shape().iter().product::<usize>()));
        let tries = 200;
        for k in 1..tries {
            // Most of what can go wrong is in the first and last kilobytes.
            let cut = if k % 2 == 0 { whole.len() * k / tries } else { whole.len().min(37 * k) };
            let _ = TensorFile::parse(&whole[..cut]);
        }
        if whole.len() < 200_000 {
            for k in 0..400_usize {
                let mut changed = whole.clone();
                let at = (k * 7919) % changed.len().min(8192);
                changed[at] ^= 1 << (k % 8);
                let _ = TensorFile::parse(&changed);
            }
        }
    }
}

/// A pickle of an object of a class, with a state.
fn object(class: &str, state: &[u8]) -> Vec<u8> {
    let (module, name) = class.rsplit_once('.').unwrap();
    [format!("c{module}\n{name}\n)").as_bytes(), &[0x81], state, b"b"].concat()
}

fn text(word: &str) -> Vec<u8> {
    [&[b'X'][..], &(word.len() as u32).to_le_bytes(), word.as_bytes()].concat()
}

/// A dictionary of objects by their names.
fn dictionary(entries: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let entries: Vec<u8> =
        entries.iter().flat_map(|(name, value)| [text(name), value.clone()].concat()).collect();
    [&b"}("[..], &entries, b"u"].concat()
}

#[test]
fn modules_saved_whole_hold_their_tensors() {
    // The tensor within the pickle of a dictionary.
    let pickle = samples::torch_pickle([3, 1]);
    let at = pickle.iter().position(|&b| b == b'c').unwrap();
    let tensor = pickle[at..pickle.len() - 2].to_vec();
    let real = |x: f64| [&[b'G'][..], &x.to_be_bytes()].concat();
    let whole = |module: Vec<u8>| {
        let pickle = [&b"\x80\x02"[..], &module, b"."].concat();
        samples::zip_of(&[
            ("a/data.pkl", &pickle),
            ("a/data/0", &samples::floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
        ])
    };
    let layer = object(
        "torch.nn.modules.linear.Linear",
        &dictionary(&[
            ("_parameters", dictionary(&[("weight", tensor.clone())])),
            ("in_features", b"K\x03".to_vec()),
        ]),
    );
    let activation = object(
        "torch.nn.modules.activation.Softplus",
        &dictionary(&[
            ("_parameters", b"}".to_vec()),
            ("beta", b"K\x64".to_vec()),
            ("threshold", real(20.0)),
        ]),
    );
    let module = object(
        "__main__.Field",
        &dictionary(&[
            ("_parameters", b"}".to_vec()),
            ("_modules", dictionary(&[("lin0", layer), ("act", activation)])),
        ]),
    );
    let file = TensorFile::parse(&whole(module)).unwrap();
    assert_eq!(file.iter().map(|(name, _)| name).collect::<Vec<_>>(), ["lin0.weight"]);
    assert_eq!(file.get("lin0.weight").unwrap().shape(), [2, 3]);
    let softplus = file.modules().iter().find(|module| module.class.ends_with("Softplus")).unwrap();
    assert_eq!((softplus.numbers["beta"], softplus.numbers["threshold"]), (100.0, 20.0));
    // TorchScript has attributes by their names, and the parameters of activations in its code.
    let scripted = object(
        "__torch__.Field",
        &dictionary(&[("net", object("__torch__.Linear", &dictionary(&[("weight", tensor)])))]),
    );
    let pickle = [&b"\x80\x02"[..], &scripted, b"."].concat();
    let file = TensorFile::parse(&samples::zip_of(&[
        ("a/data.pkl", &pickle),
        ("a/data/0", &samples::floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
        ("a/code/__torch__.py", b"x = torch.softplus(y, 100, 20.)\nz = torch.relu(x)\n"),
    ]))
    .unwrap();
    assert!(file.get("net.weight").is_some());
    let told: Vec<(&str, Option<f64>)> = file
        .modules()
        .iter()
        .filter(|module| !module.class.starts_with("__torch__"))
        .map(|module| (module.class.as_str(), module.numbers.get("beta").copied()))
        .collect();
    assert_eq!(told, [("ReLU", None), ("Softplus", Some(100.0))]);
}

#[test]
fn shards_are_one_file() {
    let part = |name: &str| {
        let tensor = Tensor::new(vec![1], vec![2.0]).unwrap();
        TensorFile::parse(&to_safetensors(&[(name.to_owned(), tensor)]).unwrap()).unwrap()
    };
    let whole = TensorFile::merged([part("a"), part("b")]).unwrap();
    assert_eq!(whole.iter().map(|(name, _)| name).collect::<Vec<_>>(), ["a", "b"]);
    assert!(TensorFile::merged([]).is_none());
}
