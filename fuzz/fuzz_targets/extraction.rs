//! Meshes, and values of scalars on them, of any model that is read.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ndf_core::NoProgress;
use ndf_fuzz::mend_checksums;
use ndf_intrinsic::{ExtractionOptions, extract};
use ndf_model::Model;

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    mend_checksums(&mut bytes);
    let Ok(model) = Model::from_bytes(&bytes) else { return };
    if model.field.base().face_count() > 500 {
        return;
    }
    let options = ExtractionOptions { max_faces: 5_000, ..ExtractionOptions::new(0.2) };
    let Ok(found) = extract(&model.field, &options, &NoProgress) else { return };
    found.mesh.topology().check().expect("extraction gives a manifold");
    let base = model.field.base().topology();
    assert_eq!(found.mesh.topology().euler_characteristic(), base.euler_characteristic());
    assert!(found.mesh.positions().iter().all(|p| p.is_finite()));
    for scalars in &model.scalars {
        scalars.evaluate(model.field.base(), &found.origins);
    }
});
