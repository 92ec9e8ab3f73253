//! Material libraries: MTL, with the extension that adds roughness, metal and normal maps.
//!
//! A statement that cannot be read is left out, with a warning that names its line; no other is
//! lost for it.

use super::lines::{self, Statement};

/// What a library says of a material. `None` where it says nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Entry {
    pub(super) name: String,
    /// The name without what may be a comment.
    pub(super) alias: Option<String>,
    pub(super) diffuse: Option<[f32; 3]>,
    pub(super) emissive: Option<[f32; 3]>,
    pub(super) shininess: Option<f32>,
    /// 1 is opaque.
    pub(super) dissolve: Option<f32>,
    /// 0 is opaque: the other way to say it, which counts where [`dissolve`](Self::dissolve) is not
    /// given.
    pub(super) transparency: Option<f32>,
    pub(super) roughness: Option<f32>,
    pub(super) metallic: Option<f32>,
    pub(super) diffuse_map: Option<Map>,
    pub(super) emissive_map: Option<Map>,
    pub(super) dissolve_map: Option<Map>,
    pub(super) normal_map: Option<Map>,
    pub(super) bump_map: Option<Map>,
}

/// A file that a material names, and where it lies on the surface.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Map {
    /// As the library has it.
    pub(super) name: String,
    /// The name without what may be a comment or options behind it.
    pub(super) alias: Option<String>,
    /// How often it is repeated each way.
    pub(super) scale: [f32; 2],
    /// Added to the coordinates then.
    pub(super) offset: [f32; 2],
    /// Its border goes on instead of another copy.
    pub(super) clamp: bool,
}

/// Options of a map, and how many words may follow each: numbers that `true` says so of, fewer where
/// the next word is none.
const OPTIONS: [(&str, usize, bool); 14] = [
    ("-blendu", 1, false),
    ("-blendv", 1, false),
    ("-cc", 1, false),
    ("-clamp", 1, false),
    ("-imfchan", 1, false),
    ("-type", 1, false),
    ("-bm", 1, true),
    ("-boost", 1, true),
    ("-texres", 1, true),
    ("-colorspace", 1, false),
    ("-mm", 2, true),
    ("-o", 3, true),
    ("-s", 3, true),
    ("-t", 3, true),
];

/// The materials of a library's text. `warn` is told the line and what is wrong in it.
pub(super) fn parse(text: &str, mut warn: impl FnMut(usize, String)) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let each = |s: Statement<'_>| -> Result<(), std::convert::Infallible> {
        let key = s.key.to_ascii_lowercase();
        if key == "newmtl" {
            let (name, alias) = s.names();
            if name.is_empty() {
                warn(s.line, "`newmtl` names nothing".to_owned());
            }
            entries.push(Entry { name: name.to_owned(), alias: alias.map(str::to_owned), ..Entry::default() });
            return Ok(());
        }
        let told = match entries.last_mut() {
            Some(entry) => entry.set(&key, &s),
            None => Err("stands before the first `newmtl`".to_owned()),
        };
        if let Err(problem) = told {
            warn(s.line, format!("`{}` is left out: {problem}", s.key));
        }
        Ok(())
    };
    match lines::statements(text, each) {
        Ok(()) => entries,
    }
}

impl Entry {
    /// Takes in a statement; what nobody here reads is passed over.
    fn set(&mut self, key: &str, s: &Statement<'_>) -> Result<(), String> {
        match key {
            "kd" => self.diffuse = Some(color(s.plain())?),
            "ke" => self.emissive = Some(color(s.plain())?),
            "ns" => self.shininess = Some(number(s.plain())?),
            "d" => self.dissolve = Some(number(s.plain().trim_start().trim_start_matches("-halo"))?),
            "tr" => self.transparency = Some(number(s.plain())?),
            "pr" => self.roughness = Some(number(s.plain())?),
            "pm" => self.metallic = Some(number(s.plain())?),
            "map_kd" => self.diffuse_map = Some(map(s)?),
            "map_ke" => self.emissive_map = Some(map(s)?),
            "map_d" => self.dissolve_map = Some(map(s)?),
            "norm" => self.normal_map = Some(map(s)?),
            "map_bump" | "bump" => self.bump_map = Some(map(s)?),
            _ => {}
        }
        Ok(())
    }
}

fn number(words: &str) -> Result<f32, String> {
    let word = words.split_ascii_whitespace().next().ok_or("a number is missing")?;
    word.parse().ok().filter(|v: &f32| v.is_finite()).ok_or_else(|| format!("'{word}' is not a finite number"))
}

/// A colour: red, green and blue, all three the first where it stands alone, or CIE XYZ.
fn color(words: &str) -> Result<[f32; 3], String> {
    let xyz = words.trim_start().get(..3).filter(|w| w.eq_ignore_ascii_case("xyz"));
    let words = if xyz.is_some() { &words.trim_start()[3..] } else { words };
    if words.split_ascii_whitespace().next().is_some_and(|w| w.eq_ignore_ascii_case("spectral")) {
        return Err("files of spectra are not read".to_owned());
    }
    let first = number(words)?;
    let mut out = [first; 3];
    for (out, word) in out.iter_mut().zip(words.split_ascii_whitespace()).skip(1) {
        *out = number(word)?;
    }
    Ok(if xyz.is_some() { bouncelight::srgb::from_xyz(out) } else { out })
}

/// The file that a map statement names, and its options, which stand before the name or behind it.
fn map(s: &Statement<'_>) -> Result<Map, String> {
    let mut map = Map { name: String::new(), alias: None, scale: [1.0; 2], offset: [0.0; 2], clamp: false };
    let mut rest = s.rest;
    while let Some(after) = option(&mut map, rest)? {
        rest = after;
    }
    if rest.is_empty() {
        return Err("names no file".to_owned());
    }
    map.name = rest.trim_matches('"').to_owned();
    let mut alias = Statement { rest, ..*s }.names().1.unwrap_or(rest);
    for (at, _) in rest.match_indices(" -").chain(rest.match_indices("\t-")) {
        let (name, mut behind) = (rest[..at].trim_end(), rest[at..].trim_start());
        let mut whole = map.clone();
        while let Some(after) = option(&mut whole, behind).unwrap_or(None) {
            behind = after;
        }
        if behind.is_empty() || behind.starts_with('#') {
            (map, alias) = (whole, name);
            break;
        }
    }
    map.alias = (alias != rest).then(|| alias.trim_matches('"').to_owned());
    Ok(map)
}

/// Takes in the option that `words` begins with, and gives what follows it; `None` where it begins
/// with none.
fn option<'a>(map: &mut Map, words: &'a str) -> Result<Option<&'a str>, String> {
    let (word, mut rest) = next(words);
    let Some(&(name, most, numbers)) = OPTIONS.iter().find(|o| o.0.eq_ignore_ascii_case(word)) else {
        return Ok(None);
    };
    let mut values = [None; 3];
    for value in values.iter_mut().take(most) {
        let (word, after) = next(rest);
        let parsed = word.parse::<f32>().ok().filter(|v| v.is_finite());
        if numbers && parsed.is_none() {
            break;
        }
        if name == "-clamp" {
            map.clamp = word.eq_ignore_ascii_case("on");
        }
        (*value, rest) = (parsed, after);
    }
    // What is left out is as by default.
    match name {
        "-s" => map.scale = [values[0].unwrap_or(1.0), values[1].unwrap_or(1.0)],
        "-o" => map.offset = [values[0].unwrap_or(0.0), values[1].unwrap_or(0.0)],
        _ => {}
    }
    if numbers && values[0].is_none() { Err(format!("`{name}` lacks its number")) } else { Ok(Some(rest)) }
}

/// The first word, and what follows it.
fn next(words: &str) -> (&str, &str) {
    let end = words.bytes().position(|b| b.is_ascii_whitespace()).unwrap_or(words.len());
    (&words[..end], words[end..].trim_ascii_start())
}
