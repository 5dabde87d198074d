//! Short hashes of long texts, the same on every machine and in every version.

/// Computes FNV-1a, 64 bits: written here because it must never change.
pub(crate) fn fnv(bytes: &[u8]) -> u64 {
    hash(bytes.iter().map(|byte| u64::from(*byte)))
}

/// Computes the same for numbers.
pub(crate) fn hash(numbers: impl Iterator<Item = u64>) -> u64 {
    numbers.fold(0xcbf2_9ce4_8422_2325, |hash, number| (hash ^ number).wrapping_mul(0x0100_0000_01b3))
}

/// Returns the hash of several texts, in their order.
pub(crate) fn fingerprint(parts: &[&str]) -> String {
    let bytes: Vec<u8> = parts.iter().flat_map(|part| part.bytes().chain([0])).collect();
    format!("{:016x}", fnv(&bytes))
}
