//! Model files and their export.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ndf_fuzz::mend_checksums;
use ndf_model::Model;

fuzz_target!(|bytes: &[u8]| {
    let _ = Model::from_safetensors(bytes);
    let mut bytes = bytes.to_vec();
    mend_checksums(&mut bytes);
    if let Ok(model) = Model::from_bytes(&bytes) {
        assert!(Model::from_bytes(&model.to_bytes()).is_ok());
    }
});
