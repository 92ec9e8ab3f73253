//! Speed of rays: primary, shadow and diffuse ones through the rooms of the paper, and their cost
//! against the number of triangles.
//!
//!     cargo run --release --example rays -- [--repeat N] [--csv F.csv] [--svg F.svg]
//!     cargo run --release --example rays -- --traffic SCENE,SCENE,…      # what a frame's rays read of each scene's trees
//!
//! Rays are read from and hits written to buffers, which counts; the row `nothing` says how much
//! that is. On a CPU driver the time is that of the processor, not the clock on the wall, so that
//! other work on the machine does not count.

use bouncelight::accel::RayCaster;
use bouncelight::gpu::{Gpu, GpuOptions};
use bouncelight::study::rays::{KINDS, RayScene, RayTest};
use bouncelight::study::traffic;
use std::fmt::Write;

/// A scene's name and its rays.
struct Row {
    name: String,
    test: RayTest,
}

/// Cost a ray over the number of triangles; a straight line is a logarithm.
fn chart(rows: &[Row], adapter: &str) -> String {
    let (width, height, left, bottom, top) = (760.0, 420.0, 64.0, 360.0, 48.0);
    let most = rows.iter().flat_map(|r| r.test.nanoseconds).fold(0.0, f64::max) * 1.1;
    let x = |triangles: f64| left + (triangles.log10() - 2.85) / 3.25 * (width - left - 110.0);
    let y = |ns: f64| bottom - ns / most * (bottom - top);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
        font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"{left}\" y=\"20\" font-size=\"15\">Cost of a ray against the number of triangles</text>\n\
         <text x=\"{left}\" y=\"37\" fill=\"#666\">27 spheres in a box; dashed: a + b · log(triangles), fitted. {adapter}</text>\n"
    );
    for decade in 3..=6 {
        let at = x(10f64.powi(decade));
        let _ = writeln!(
            svg,
            "<path d=\"M{at:.1} {top}V{bottom}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{}\" \
            text-anchor=\"middle\">10{}</text>",
            bottom + 20.0,
            ['³', '⁴', '⁵', '⁶'][decade as usize - 3]
        );
    }
    let step = 10f64.powf((most / 3.0).log10().floor());
    let step = if most / step > 10.0 { step * 2.5 } else { step };
    for tick in (0..).map(|i| f64::from(i) * step).take_while(|t| *t < most) {
        let at = y(tick);
        let _ = writeln!(
            svg,
            "<path d=\"M{left} {at:.1}H{}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{:.1}\" \
            text-anchor=\"end\">{tick:.0}</text>",
            width - 110.0,
            left - 6.0,
            at + 4.0
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{:.0}\" y=\"{}\" text-anchor=\"middle\">triangles</text>",
        (left + width - 110.0) / 2.0,
        bottom + 42.0
    );
    let _ = writeln!(
        svg,
        "<text transform=\"translate(16 {:.0}) rotate(-90)\" text-anchor=\"middle\">ns a ray</text>",
        (top + bottom) / 2.0
    );
    for (k, color) in ["#1b6ca8", "#c7522a", "#3a7d44"].iter().enumerate() {
        let (a, b, fit) = logarithm(rows, k);
        let points = rows.iter().map(|r| format!("{:.1},{:.1}", x(r.test.triangles as f64), y(r.test.nanoseconds[k])));
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>",
            points.collect::<Vec<_>>().join(" ")
        );
        for r in rows {
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.5\" fill=\"{color}\"/>",
                x(r.test.triangles as f64),
                y(r.test.nanoseconds[k])
            );
        }
        let line = |n: f64| y((a + b * n.log10()).max(0.0));
        let _ = writeln!(
            svg,
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"{color}\" stroke-dasharray=\"4 4\"/>",
            x(1e3),
            line(1e3),
            x(1.2e6),
            line(1.2e6)
        );
        let end = rows.last().map_or(0.0, |r| y(r.test.nanoseconds[k]));
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{color}\">{}</text>",
            width - 104.0,
            end + 4.0,
            KINDS[k]
        );
        println!("{}: {a:.0} + {b:.0} · log10(triangles) ns a ray, R² {fit:.3}", KINDS[k]);
    }
    svg + "</svg>\n"
}

/// Least squares of cost against log10(triangles): offset, slope, R².
fn logarithm(rows: &[Row], kind: usize) -> (f64, f64, f64) {
    let n = rows.len() as f64;
    let points: Vec<_> = rows.iter().map(|r| ((r.test.triangles as f64).log10(), r.test.nanoseconds[kind])).collect();
    let (mx, my) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p.0 - mx, p.1 - my)).sum::<f64>();
    let (xy, xx, yy) = (sum(&|x, y| x * y), sum(&|x, _| x * x), sum(&|_, y| y * y));
    (my - xy / xx * mx, xy / xx, xy * xy / (xx * yy))
}

/// What a frame of `gather` at 1024×512 reads of each scene's trees.
fn traffic(names: &str) -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "| scene | trees, MB | looks | blocks a look: nearest, to the light, to the entry | in all, MB | not near, MB \
         | from memory, MB | steps with waiting |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for name in names.split(',') {
        let scene = bouncelight::scene::load(name)?;
        let camera = scene.cameras.first().ok_or_else(|| format!("{name} has no camera"))?;
        let t = traffic::count(&scene, camera, [1024, 512])?;
        let [nearest, light, entry] = t.read;
        let [size, asked, fetched, missed] = [64.0 * t.blocks as f64, t.asked, t.fetched, t.missed].map(|b| b / 1e6);
        println!(
            "| {name} | {size:.1} | {} | {nearest:.1}, {light:.1}, {entry:.1} | {asked:.0} | {fetched:.0} | \
            {missed:.1} | {:.2} |",
            t.looks, t.waiting
        );
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let value = |name: &str| args.iter().position(|a| a == name).and_then(|i| args.get(i + 1));
    if let Some(names) = value("--traffic") {
        return traffic(names);
    }
    let repeat = value("--repeat").map_or(Ok(9), |n| n.parse())?;
    let gpu = Gpu::open(&GpuOptions::default())?;
    println!("{}", gpu.sentence());
    let caster = RayCaster::new(&gpu.device);
    let test =
        |name: &str, scene: RayScene| RayTest::new(&gpu, &caster, &scene).map(|test| Row { name: name.into(), test });
    let mut rows = vec![test("nothing", RayScene::nothing())?];
    for name in ["cornell", "interior", "paper-room:0", "paper-room:1", "paper-room:2"] {
        rows.push(test(name, RayScene::of(&bouncelight::scene::load(name)?))?);
    }
    for count in [1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000] {
        rows.push(test(&format!("spheres {count}"), RayScene::spheres(count))?);
    }
    // All scenes in turn, so that other work on the machine hits all alike.
    for _ in 0..repeat {
        rows.iter_mut().for_each(|row| row.test.measure(&gpu, &caster));
    }
    println!("| scene | triangles | MiB | build, s | primary, Mray/s | shadow | diffuse | visits, primary / diffuse |");
    println!("|---|---|---|---|---|---|---|---|");
    for Row { name, test } in &rows {
        let ([p, s, d], [u, _, w]) = (test.nanoseconds.map(|ns| 1e3 / ns), test.visits);
        let (triangles, size, build) = (test.triangles, test.bytes as f64 / 1_048_576.0, test.build);
        println!("| {name} | {triangles} | {size:.1} | {build:.2} | {p:.2} | {s:.2} | {d:.2} | {u:.1} / {w:.1} |");
    }
    let rows = &rows[6..];
    let svg = chart(rows, &gpu.info.name);
    if let Some(path) = value("--csv") {
        let mut csv =
            String::from("triangles,bytes,build_s,primary_ns,shadow_ns,diffuse_ns,primary_visits,diffuse_visits\n");
        for r in rows {
            let [a, b, c] = r.test.nanoseconds;
            let [u, _, w] = r.test.visits;
            writeln!(
                csv,
                "{},{},{:.3},{a:.1},{b:.1},{c:.1},{u:.2},{w:.2}",
                r.test.triangles, r.test.bytes, r.test.build
            )?;
        }
        std::fs::write(path, csv)?;
    }
    if let Some(path) = value("--svg") {
        std::fs::write(path, svg)?;
    }
    Ok(())
}
