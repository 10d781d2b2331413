//! Pictures as bytes of files.

use std::io::Cursor;

use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, LayerAttributes, WritableImage};

use super::Image;

/// The picture as PNG: 8-bit sRGB, over white or with its opacity.
///
/// # Errors
/// If the picture is larger than the format allows.
pub fn png_bytes(image: &Image, transparent: bool) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width as u32, image.height as u32);
    encoder.set_color(if transparent { png::ColorType::Rgba } else { png::ColorType::Rgb });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut pixels = Vec::with_capacity(image.colour.len() * if transparent { 4 } else { 3 });
    for &[r, g, b, opacity] in &image.colour {
        if transparent {
            let colour = [r, g, b].map(|c| if opacity > 0.0 { encoded(c / opacity) } else { 0 });
            pixels.extend([colour[0], colour[1], colour[2], (255.0 * opacity).round() as u8]);
        } else {
            pixels.extend([r, g, b].map(|c| encoded(c + 1.0 - opacity)));
        }
    }
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(bytes)
}

/// The picture as OpenEXR with 32-bit float channels: linear `R`, `G`, `B` times opacity and `A`; `depth.Z`,
/// infinite where nothing is seen; `normal.X`, `normal.Y`, `normal.Z`; and, if there is one, `scalar.V`, NaN
/// where it has no value.
///
/// # Errors
/// If the encoder refuses the picture.
pub fn exr_bytes(image: &Image, scalar: Option<&str>) -> Result<Vec<u8>, exr::error::Error> {
    let channel = |name: &str, values: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(values));
    let component = |c: usize| image.colour.iter().map(|p| p[c]).collect();
    let normal = |c: usize| image.normal.iter().map(|n| n[c]).collect();
    let mut channels = vec![
        channel("R", component(0)),
        channel("G", component(1)),
        channel("B", component(2)),
        channel("A", component(3)),
        channel("depth.Z", image.depth.clone()),
        channel("normal.X", normal(0)),
        channel("normal.Y", normal(1)),
        channel("normal.Z", normal(2)),
    ];
    let mut attributes = LayerAttributes { software_name: Some("ndf".into()), ..LayerAttributes::default() };
    if let Some(name) = scalar {
        channels.push(channel("scalar.V", image.scalar.clone()));
        attributes.comments =
            Some(exr::prelude::Text::new_or_none(format!("scalar.V is {name}")).unwrap_or_default());
    }
    let layer = Layer::new(
        (image.width, image.height),
        attributes,
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(channels.into()),
    );
    let mut bytes = Cursor::new(Vec::new());
    exr::prelude::Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// Linear to 8-bit sRGB (IEC 61966-2-1), with a soft shoulder instead of a hard end above 0.8.
fn encoded(x: f32) -> u8 {
    let x = if x > 0.8 && x < 1.0 - 1e-6 { x } else { x.min(1.0) }.max(0.0);
    let srgb = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (255.0 * srgb).round() as u8
}
