//! Places of one cell of the table beyond its entries: rays that meet them go on, and no light is
//! lost.

use crate::common;
use crate::gather::lit;
use crate::world::{self, GREY, mean, scene, sun};
use bouncelight::gi::Method;
use bouncelight::gi::gather::Options;
use bouncelight::scene::{Camera, Scene};
use bouncelight_lab::reference::{Kernel, Layer, ReferenceScene, Subject, Tracer, TracerOptions};

/// A floor before a wall full of sunlit shelves. A tenth of a metre apart they are places that do
/// not see each other, of which each cell of the table, half a metre and wider at this distance,
/// has more than it has entries.
fn shelves(pitch: f32) -> Scene {
    let mut blocks = vec![([-2.0, -0.1, -2.0], [2.0, 0.0, 2.0], GREY), ([-2.0, 0.0, -2.1], [2.0, 2.0, -2.0], [0.8; 3])];
    for i in 1..(2.0 / pitch) as i32 {
        let y = pitch * i as f32;
        blocks.push(([-2.0, y - 0.01, -2.0], [2.0, y, -1.7], [0.8; 3]));
    }
    let camera = Camera::look_at([0.0, 4.5, 5.0], [0.0, 0.0, 0.3], 0.3);
    scene(&blocks, &[sun([0.2, -0.4, -1.0], 3.0)], 0.0, camera)
}

#[test]
fn light_from_places_that_no_entry_knows_is_not_lost() {
    let Some(gpu) = common::gpu() else { return };
    let size = [48, 36];
    let kernel = Kernel::new(&gpu.device);
    // Indirect light on the floor: by rays and by paths.
    let light = |scene: &Scene| {
        let mut renderer =
            world::renderer(&gpu, size, Method::Gather(Options { slots: world::FEW_SLOTS, ..Options::PLAIN }));
        let (rays, places) = lit(&gpu, &mut renderer, scene, 160);
        let packed = ReferenceScene::new(&gpu.device, &gpu.queue, scene).expect("it fits");
        let subject = Subject { camera: &scene.cameras[0], size, points: None };
        let options = TracerOptions { samples: 256, layers: vec![Layer::DiffInd], ..Default::default() };
        let mut tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &packed, subject, options).expect("it fits");
        while tracer.step().expect("it traces") {}
        let traced = tracer.finish().expect("it traces");
        let floor = |data: &[f32]| {
            let pixels = data.chunks_exact(3).zip(places.data.chunks_exact(3));
            mean(&pixels.filter(|(_, p)| p[1].abs() < 1e-3).map(|(e, _)| e[1]).collect::<Vec<_>>())
        };
        let truth = floor(traced.layer(Layer::DiffInd).expect("it was asked for"));
        [floor(&rays.data), truth]
    };
    let [many, one] = [0.1, 1.0].map(|pitch| light(&shelves(pitch)));
    println!("rays, paths: {many:?} from many shelves, {one:?} from one");
    let share = |[rays, paths]: [f64; 2]| rays / paths;
    // A ray that stops at the first such place finds 66 % of it, one of four segments 93 %, of
    // sixteen 98 %. What those lack is at shelves as thin as the lift of the lines that entries are
    // asked by.
    assert!((share(many) - 1.0).abs() < 0.08 && (share(one) - 1.0).abs() < 0.02, "{many:?}, {one:?}");
    // Negative control: the shelves take light away.
    assert!(share([one[0], many[1]]) > 1.5);
}
