//! Why who fails what: a sentence each, by measurement or by how the method works.

/// The sentence for a test and a subject, where there is one.
pub fn why(_test: &str, _subject: &str) -> Option<&'static str> {
    None
}
