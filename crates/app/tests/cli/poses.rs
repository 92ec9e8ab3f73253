//! Poses and sequences of an animated file.

use crate::common;
use crate::figures::{Coded, bends, strip};
use crate::program::{bouncelight, fails, path};

#[test]
fn the_program_draws_poses_and_sequences() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut glb = strip(6, Coded::Floats);
    bends(&mut glb, 2, 1.2);
    let file = path(&dir, "strip.glb");
    std::fs::write(&file, glb.bytes()).expect("written");
    let out = path(&dir, "out.png");
    fails(&["render", &file, "-o", &out, "--animation", "fly"], 2, &["fly", "1 animations: bend"]);
    fails(&["render", &file, "-o", &out, "--animation", "1"], 2, &["1 animations"]);
    fails(&["render", &file, "-o", &out, "--time", "1"], 2, &["--animation"]);
    fails(&["render", &file, "-o", &out, "--animation", "bend", "--frames", "0..2"], 2, &["{frame}"]);
    let many = path(&dir, "out_{frame}.png");
    fails(&["render", &file, "-o", &many, "--frames", "0..2"], 2, &["--animation"]);
    fails(&["render", &file, "-o", &out, "--fixed-dt", "1/24"], 2, &["--fixed-dt"]);
    let Some(_) = common::gpu() else { return };
    let run = |more: &[&str]| {
        let fixed = ["render", &file, "--size", "48x48", "--method", "direct", "--samples", "1", "--quiet"];
        // A sequence keeps the view and the exposure that its first frame asks for, a still has
        // those of its moment.
        let view = ["--eye", "0.5,1,4", "--look-at", "0,1,0", "--fov", "40", "--exposure", "0"];
        let done = bouncelight(&[&fixed, view.as_slice(), more].concat());
        assert!(done.status.success(), "{more:?}: {}", String::from_utf8_lossy(&done.stderr));
    };
    let picture = |name: &str| std::fs::read(dir.path().join(name)).expect("it was drawn");
    run(&["-o", &many, "--animation", "bend", "--frames", "0..3", "--fixed-dt", "1/2"]);
    run(&["-o", &out, "--animation", "0", "--time", "1"]);
    let pixels = |name: &str| bouncelight_scene::image_io::read_png(&dir.path().join(name)).expect("a picture").pixels;
    assert_eq!(pixels("out_2.png"), pixels("out.png"), "frame 2 is at 1 s");
    assert!(pixels("out_0.png") != pixels("out_1.png") && pixels("out_1.png") != pixels("out_2.png"));
    assert!(picture("out_0.png").len() > 100);
}
