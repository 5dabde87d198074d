//! Lines and words of the text formats.

use crate::error::excerpt;

/// Lines counted from one, without white space around them. Ends are those of any system; a byte order mark is left out.
pub(crate) fn lines(file: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let file = file.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(file);
    let end = if file.contains(&b'\n') { b'\n' } else { b'\r' };
    (1..).zip(file.split(move |&b| b == end)).map(|(number, line)| (number, line.trim_ascii()))
}

/// The part before a `#`, without white space around it.
pub(crate) fn uncommented(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default().trim_ascii()
}

/// Words parted by white space.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The number a word is; `nan` and `inf` are numbers.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    str::from_utf8(word).ok()?.parse().ok()
}

/// The number a word is, or what is wrong with it.
pub(crate) fn number_at(word: &[u8], line: usize) -> Result<f64, String> {
    number(word)
        .ok_or_else(|| format!("line {line}: `{}` is not a number; correct it or export the file again", excerpt(word)))
}

/// The next three words as numbers.
pub(crate) fn three<'a>(words: &mut impl Iterator<Item = &'a [u8]>, line: usize) -> Result<[f64; 3], String> {
    let mut found = [0.0; 3];
    for (at, value) in found.iter_mut().enumerate() {
        let word = words.next().ok_or_else(|| {
            format!("line {line}: expected 3 numbers, found {at}; correct it or export the file again")
        })?;
        *value = number_at(word, line)?;
    }
    Ok(found)
}

/// Cuts a polygon into triangles around its first corner.
pub(crate) fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let rest = corners.get(1..).unwrap_or_default();
    rest.windows(2).map(|pair| [corners[0], pair[0], pair[1]])
}
