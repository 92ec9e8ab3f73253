//! One WGSL text out of many files: the line `//#import lib/frame.wgsl` brings that file in, once
//! and before the file that says so.

use crate::gpu::pipeline_cache;
use include_dir::{Dir, File, include_dir};
use std::path::{Path, PathBuf};
use std::sync::RwLock;

/// The files under `shaders/` as they were when the program was built.
static EMBEDDED: Dir<'static> = include_dir!("$CARGO_MANIFEST_DIR/shaders");

/// All files and their texts, as they were then.
pub(super) fn files() -> impl Iterator<Item = (&'static str, &'static str)> {
    fn all(dir: &'static Dir<'static>) -> Vec<&'static File<'static>> {
        dir.dirs().flat_map(all).chain(dir.files()).collect()
    }
    all(&EMBEDDED).into_iter().filter_map(|f| Some((f.path().to_str()?, f.contents_utf8()?)))
}

/// What begins a line that names a file to bring in.
const IMPORT: &str = "//#import ";

/// Where files are read from instead, where they are there; nothing by default.
static FOLDER: RwLock<Option<PathBuf>> = RwLock::new(None);

/// Reads shaders from `folder` from now on, where it has them, so that they can be edited while a
/// program runs. `None` goes back to what was compiled in.
pub fn read_from(folder: Option<PathBuf>) {
    if let Ok(mut place) = FOLDER.write() {
        // What is edited has another text each time, and nobody asks for the one before.
        pipeline_cache::keeps(folder.is_none());
        *place = folder;
    }
}

/// The folder that shaders are read from, if any.
pub fn folder() -> Option<PathBuf> {
    FOLDER.read().ok().and_then(|f| f.clone())
}

/// A joined text, and where its lines come from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Joined {
    /// The text.
    pub text: String,
    /// Files in order, each with its first line in [`text`](Self::text), from 1.
    pub files: Vec<(usize, String)>,
    /// Files that were named but are nowhere.
    pub missing: Vec<String>,
}

impl Joined {
    /// `roots` and all that they import, behind `prelude`.
    pub fn new<'a>(prelude: &str, roots: impl IntoIterator<Item = &'a str>) -> Self {
        let mut joined = Self { text: prelude.to_owned(), ..Self::default() };
        let folder = folder();
        for root in roots {
            joined.add(root, folder.as_deref());
        }
        joined
    }

    fn add(&mut self, file: &str, folder: Option<&Path>) {
        if self.files.iter().any(|(_, f)| f == file) || self.missing.iter().any(|f| f == file) {
            return;
        }
        let edited = folder.and_then(|f| std::fs::read_to_string(f.join(file)).ok());
        let embedded = || EMBEDDED.get_file(file).and_then(|f| f.contents_utf8()).map(str::to_owned);
        let Some(body) = edited.or_else(embedded) else {
            self.missing.push(file.to_owned());
            return;
        };
        // Known from here on, so that files may import each other; its place is corrected below.
        let index = self.files.len();
        self.files.push((0, file.to_owned()));
        for import in body.lines().filter_map(|line| line.strip_prefix(IMPORT)) {
            self.add(import.trim(), folder);
        }
        let entry = self.files.remove(index);
        self.files.push((self.text.lines().count() + 1, entry.1));
        self.text.push_str(&body);
        self.text.push('\n');
    }

    /// The file of a line of the text and the line in it, both from 1; nothing within the prelude.
    pub fn place(&self, line: usize) -> Option<(&str, usize)> {
        let (first, file) = self.files.iter().rev().find(|(first, _)| *first <= line)?;
        Some((file, line - first + 1))
    }

    /// A compiler's `message` about the text, with `wgsl:LINE:` as the file and line that it speaks
    /// of.
    pub fn located(&self, message: &str) -> String {
        const MARK: &str = "wgsl:";
        let mut parts = message.split(MARK);
        let mut said = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let digits = part.bytes().take_while(u8::is_ascii_digit).count();
            match part[..digits].parse().ok().and_then(|line| self.place(line)) {
                Some((file, line)) => said += &format!("{file}:{line}{}", &part[digits..]),
                None => said += &format!("{MARK}{part}"),
            }
        }
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_comes_once_and_behind_what_it_imports() {
        let joined = Joined::new("const A = 1;\n", ["gi/gather/trace.wgsl", "gi/inputs.wgsl"]);
        assert!(joined.missing.is_empty());
        let at = |name: &str| joined.files.iter().position(|(_, f)| f == name).expect("it is there");
        assert!(at("lib/octahedral.wgsl") < at("gi/inputs.wgsl") && at("gi/inputs.wgsl") < at("gi/gather/trace.wgsl"));
        assert_eq!(joined.files.iter().filter(|(_, f)| f == "gi/inputs.wgsl").count(), 1);
        let (first, file) = &joined.files[2];
        assert_eq!(joined.place(*first), Some((file.as_str(), 1)));
        assert_eq!(joined.place(first - 1).map(|p| p.0), Some(joined.files[1].1.as_str()));
        assert_eq!(joined.place(1), None, "the prelude is no file");
    }

    #[test]
    fn a_message_names_the_file_and_its_line() {
        let joined = Joined::new("const A = 1;\n", ["gi/gather/trace.wgsl"]);
        let (first, file) = joined.files.last().expect("it has files").clone();
        let said = joined.located(&format!("no such name\n  ┌─ wgsl:{}:5\n", first + 6));
        assert_eq!(said, format!("no such name\n  ┌─ {file}:7:5\n"));
        assert_eq!(joined.located("at wgsl:1:1"), "at wgsl:1:1", "lines of the prelude stay");
    }

    #[test]
    fn a_file_that_is_nowhere_is_told() {
        assert_eq!(Joined::new("", ["lib/nowhere.wgsl"]).missing, ["lib/nowhere.wgsl"]);
    }
}
