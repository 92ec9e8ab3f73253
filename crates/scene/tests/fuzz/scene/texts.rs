//! Hostile OBJ files with their libraries, and pictures of the surroundings.

use crate::spoil::Random;
use bouncelight_scene::image_io::{Layer, write_exr};

/// An OBJ file and its library.
pub type Model = [String; 2];

/// Words that readers stumble over, and those that files consist of.
const WORDS: [&str; 56] = [
    "",
    "0",
    "-1",
    "1",
    "2",
    "-0",
    "+1",
    "1e999",
    "-1e38",
    "1e-45",
    "nan",
    "inf",
    "0x10",
    "1,5",
    "1.",
    ".5",
    "4294967295",
    "4294967296",
    "-9223372036854775808",
    "9223372036854775808",
    "1/1/1",
    "1//1",
    "/",
    "//",
    "1/",
    "/1",
    "1/1/1/1",
    "-1/-1/-1",
    "\\",
    "#",
    "\"",
    "\t",
    "\r",
    "\u{0}",
    "\u{fffd}ä",
    "v",
    "vt",
    "vn",
    "f",
    "l",
    "usemtl",
    "mtllib",
    "case.mtl",
    "newmtl",
    "Kd",
    "xyz",
    "spectral",
    "d",
    "-halo",
    "Tr",
    "map_Kd",
    "-s",
    "-o",
    "-clamp",
    "on",
    "t.png",
];

/// The sound files that mutations start from.
pub fn models() -> Vec<Model> {
    let square = "v -1 -1 0\nv 1 -1 0 1 0 0\nv 1 1 0 0 1 0 0.5\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1 0\nvt 0.5\nvn 0 0 1\n";
    let full = format!(
        "# a file\nmtllib case.mtl none.mtl\no one\n{square}usemtl a b\nf 1/1/1 2/2/1 3/3/1 4/4/1\ng two\nusemtl second \
         # and last\nf -4//-1 -3//-1 \\\n -2//-1\nf 1/1 2/2 3/3\nl 1 2 3\ns off\n"
    );
    let comb: String = (0..24).map(|i| format!("v {i} {} 0\n", if i % 2 == 0 { 1 } else { 9 })).collect();
    let outline: Vec<String> = (1..=24).rev().map(|i| i.to_string()).collect();
    let concave = format!("{comb}v 23 0 0\nv 0 0 0\nf {} 26 25\n", outline.join(" "));
    let library = "newmtl a b\nKd 1 0.5 0.25\nKe 0 0 1\nNs 30\nd 0.5\nTr 0.5\nmap_Kd -s 2 2 1 -o 0.5 0 t.png\nnorm -bm 1 t.png\n\
                   newmtl second\nKd xyz 0.2 0.3 0.4\nd -halo 0.9\nPr 0.5\nPm 1\nmap_Kd -clamp on t.png\nmap_d t.png\nmap_Bump b c.png\n";
    vec![[full, library.to_owned()], [concave, String::new()]]
}

/// One hostile file and its library.
pub fn model(from: &[Model], random: &mut Random) -> [Vec<u8>; 2] {
    let [mut obj, mut mtl] = random.pick(from).clone();
    match random.below(4) {
        0 => mtl = spoilt(&mtl, random),
        1 => (obj, mtl) = (spoilt(&obj, random), spoilt(&mtl, random)),
        _ => obj = spoilt(&obj, random),
    }
    [obj, mtl].map(|text| {
        let mut bytes = text.into_bytes();
        if random.below(8) == 0 {
            spoil_bytes(&mut bytes, random);
        }
        bytes
    })
}

/// Text with words and lines replaced, put in, taken away, doubled.
fn spoilt(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<Vec<String>> = text.lines().map(|l| l.split(' ').map(str::to_owned).collect()).collect();
    for _ in 0..1 + random.below(5) {
        if lines.is_empty() {
            break;
        }
        let at = random.below(lines.len());
        let other = random.below(lines.len());
        let word = random.pick(&WORDS).to_string();
        let inside = random.below(lines[at].len());
        match random.below(12) {
            0 => drop(lines.remove(at)),
            1 => lines.insert(at, lines[other].clone()),
            2 => lines.swap(at, other),
            3 => lines[at].truncate(inside),
            4 => lines[at].push(word),
            5 => lines[at].insert(inside, word),
            6 if random.below(20) == 0 => lines[at] = vec![lines[at].join(" "); 400],
            7 if random.below(20) == 0 => lines = std::iter::repeat_n(lines.concat(), 30).collect(),
            _ if inside < lines[at].len() => lines[at][inside] = word,
            _ => {}
        }
    }
    let separator = *random.pick(&["\n", "\n", "\n", "\r\n", "\r", " \\\n"]);
    lines.iter().map(|l| l.join(" ")).collect::<Vec<_>>().join(separator)
}

/// A few bytes changed, cut off, doubled.
pub fn spoil_bytes(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..1 + random.below(4) {
        if bytes.is_empty() {
            return;
        }
        // Mostly near the front, where the sizes are.
        let end = if random.below(3) == 0 { bytes.len() } else { bytes.len().min(420) };
        let at = random.below(end);
        match random.below(8) {
            0..=2 => bytes[at] ^= 1 << random.below(8),
            3..=4 => bytes[at] = *random.pick(&[0, 1, 2, 127, 128, 255, b'-', b'9']),
            5 => bytes.truncate(at),
            6 => drop(bytes.drain(at..(at + 1 + random.below(16)).min(bytes.len()))),
            _ => {
                let piece = bytes[at..(at + 1 + random.below(16)).min(bytes.len())].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
}

/// Pictures of the surroundings that mutations start from: Radiance's codings and EXR's.
pub fn skies() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("sky.exr");
    let ramp: Vec<f32> = (0..16 * 8).map(|i| i as f32 / 64.0).collect();
    let channels = ["R", "G", "B"].map(|c| (c.to_owned(), ramp.clone())).to_vec();
    let written = |layers: &[Layer]| {
        write_exr(&path, 16, 8, layers, &[("Software".into(), "a test".into())]).expect("it is written");
        std::fs::read(&path).expect("it is there")
    };
    let half = written(&[Layer { name: String::new(), channels: channels.clone() }]);
    let named = written(&[Layer { name: "Depth".into(), channels }]);
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 8 +X 16\n".as_bytes();
    let flat: Vec<u8> = (0..16 * 8).flat_map(|i| [i as u8, 128, 200, 129]).collect();
    let packed: Vec<u8> =
        (0..8u8).flat_map(|y| [[2, 2, 0, 16].to_vec(), [128 + 16, y + 100].repeat(4)].concat()).collect();
    let repeated = [[9, 9, 9, 129], [1, 1, 1, 15]].concat().repeat(8);
    let radiance = [flat, packed, repeated].map(|pixels| [header, &pixels].concat());
    radiance.into_iter().chain([half, named]).collect()
}
