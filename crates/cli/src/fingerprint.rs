//! Short names for long texts, the same on every machine and in every version.

/// FNV-1a, 64 bits: named here because it must never change.
pub(crate) fn fnv(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Of several texts, in their order.
pub(crate) fn fingerprint(parts: &[&str]) -> String {
    let bytes: Vec<u8> = parts.iter().flat_map(|part| part.bytes().chain([0])).collect();
    format!("{:016x}", fnv(&bytes))
}
