//! Messages about settings, in words for the user.

/// Phrases of serde, and what the user reads instead.
const WORDS: [(&str, &str); 5] = [
    ("wanted exactly 1 element, more than 1 element", "two members of one family; keep only one of their tables"),
    ("expected u64", "expected a whole number, 0 or above"),
    ("expected usize", "expected a whole number, 0 or above"),
    ("expected f64", "expected a number"),
    ("invalid type: unit variant, expected newtype variant", "a member is a table of settings: write { NAME = {} }"),
];
/// What serde puts before the name of a type of ours.
const STRUCT: &str = "expected struct ";

/// Adds the nearest valid name to serde's message about an unknown one, and rephrases messages for the user.
pub(crate) fn with_suggestion(message: &str) -> String {
    let message = WORDS.iter().fold(message.trim().to_owned(), |said, (serde, user)| said.replace(serde, user));
    let message = match message.split_once(STRUCT) {
        Some((before, _)) => format!("{before}expected a table of settings"),
        None => message,
    };
    let message = message.as_str();
    let mut names = message.split('`').skip(1).step_by(2);
    match names.next() {
        Some(unknown) if message.starts_with("unknown ") => {
            let valid: Vec<&str> = names.collect();
            format!("{message}{}", suggestion(unknown, &valid))
        }
        _ => message.to_owned(),
    }
}

pub(crate) fn suggestion(unknown: &str, valid: &[&str]) -> String {
    let unknown = &unknown.to_lowercase();
    let nearest = valid.iter().map(|name| (strsim::damerau_levenshtein(unknown, name), name)).min();
    match nearest {
        Some((distance, name)) if distance <= unknown.chars().count().div_ceil(2) => {
            format!("; did you mean `{name}`?")
        }
        _ => String::new(),
    }
}
