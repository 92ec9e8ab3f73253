//! An EXR's picture through a view transform, as PNG: `cargo run --example tonemap -- in.exr
//! out.png [filmic|agx|neutral|none]`.
//!
//! The same curve as `bouncelight render`, for pictures from elsewhere, such as a path tracer's
//! reference.

use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight_scene::image_io;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (input, output, tonemap) = match args.as_slice() {
        [input, output] => (input, output, Tonemap::Filmic),
        [input, output, tonemap] => (input, output, tonemap.parse()?),
        _ => return Err("usage: tonemap IN.exr OUT.png [filmic|agx|neutral|none]".into()),
    };
    let layers = image_io::read_exr(Path::new(input))?;
    layers.check_finite("Combined")?;
    let image = layers.image("Combined")?;
    let rgb = tonemap.apply_to_bytes(&image.to_rgb());
    image_io::write_png(Path::new(output), image.width, image.height, &rgb, &layers.metadata)?;
    Ok(())
}
