//! Resource limits: what this process may take for itself without an operator.

use nix::sys::resource::{Resource, getrlimit, rlim_t, setrlimit};

/// Raises the soft limit to the hard one, which needs no rights, and says what is in force then.
///
/// The kernel judges requests by the soft limit, which login shells like to set lower.
pub(super) fn raise_soft_limit(resource: Resource) -> rlim_t {
    if let Ok((soft, hard)) = getrlimit(resource)
        && soft < hard
    {
        // If this fails, the request that needs it fails too, and its report says so.
        let _ = setrlimit(resource, hard, hard);
    }
    getrlimit(resource).map_or(0, |(soft, _hard)| soft)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Core files are as good a resource as any, and no other test looks at their limit.
    #[test]
    fn the_soft_limit_rises_to_the_hard_one_and_no_further() {
        let (_, hard) = getrlimit(Resource::RLIMIT_CORE).unwrap();
        setrlimit(Resource::RLIMIT_CORE, 0, hard).unwrap();
        assert_eq!(raise_soft_limit(Resource::RLIMIT_CORE), hard);
        assert_eq!(getrlimit(Resource::RLIMIT_CORE).unwrap(), (hard, hard));
    }
}
