//! A worker's part of a manifest.

use std::str::FromStr;

/// A part of a manifest: the items with a number equal to `index` modulo `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 0.
    pub index: u64,
    /// Number of parts.
    pub count: u64,
}

/// Reason for an unknown shard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShardError {
    /// Not in the form `I/N`.
    #[error("expected I/N with I from 1 to N, for example 1/8")]
    Form,
    /// A scheduler states the part, but not the number of parts.
    #[error("{index} is set but {count} isn't: set it to the number of shards, or use --shard I/N")]
    NoCount {
        /// The variable that is set.
        index: &'static str,
        /// The variable that isn't set.
        count: &'static str,
    },
    /// A variable without a valid number.
    #[error("{variable}={value:?} doesn't fit: use --shard I/N")]
    Value {
        /// Name of the environment variable.
        variable: &'static str,
        /// The value as given.
        value: String,
    },
    /// Task numbers of an array aren't evenly spaced.
    #[error(
        "the numbers of the array's tasks aren't evenly spaced, so they don't tell the shard: use --shard I/N"
    )]
    Uneven,
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let (number, count) = text.split_once('/').ok_or(ShardError::Form)?;
        let (number, count): (u64, u64) = (
            number.trim().parse().map_err(|_| ShardError::Form)?,
            count.trim().parse().map_err(|_| ShardError::Form)?,
        );
        if number == 0 || number > count {
            return Err(ShardError::Form);
        }
        Ok(Self { index: number - 1, count })
    }
}

impl Shard {
    /// A single shard with every item.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// Shard from a scheduler's variables: Slurm's job arrays, Kubernetes' indexed jobs, AWS
    /// Batch's array jobs. Everything without a scheduler.
    ///
    /// # Errors
    ///
    /// [`ShardError`].
    pub fn of_scheduler(variable: &dyn Fn(&str) -> Option<String>) -> Result<Self, ShardError> {
        let number = |name: &'static str| {
            let Some(value) = variable(name) else { return Ok(None) };
            match value.trim().parse::<u64>() {
                Ok(number) => Ok(Some(number)),
                Err(_) => Err(ShardError::Value { variable: name, value }),
            }
        };
        if let Some(task) = number("SLURM_ARRAY_TASK_ID")? {
            let of = |name| {
                number(name)?
                    .ok_or(ShardError::NoCount { index: "SLURM_ARRAY_TASK_ID", count: name })
            };
            let (count, first, last) = (
                of("SLURM_ARRAY_TASK_COUNT")?,
                of("SLURM_ARRAY_TASK_MIN")?,
                of("SLURM_ARRAY_TASK_MAX")?,
            );
            return of_array(task, count, first, last);
        }
        for (index_name, count_names) in [
            ("JOB_COMPLETION_INDEX", &["BORESIGHT_SHARDS"][..]),
            ("AWS_BATCH_JOB_ARRAY_INDEX", &["BORESIGHT_SHARDS", "AWS_BATCH_JOB_ARRAY_SIZE"][..]),
        ] {
            let Some(index) = number(index_name)? else { continue };
            let mut count = None;
            for name in count_names {
                count = count.or(number(name)?);
            }
            let count =
                count.ok_or(ShardError::NoCount { index: index_name, count: count_names[0] })?;
            if index >= count {
                let value = index.to_string();
                return Err(ShardError::Value { variable: index_name, value });
            }
            return Ok(Self { index, count });
        }
        Ok(Self::WHOLE)
    }

    /// True if the item with number `number`, from 0, is in the shard.
    pub fn has(self, number: u64) -> bool {
        number % self.count == self.index
    }
}

/// Shard of `task` in an array of `count` tasks numbered from `first` to `last`.
fn of_array(task: u64, count: u64, first: u64, last: u64) -> Result<Shard, ShardError> {
    if count == 1 {
        return Ok(Shard::WHOLE);
    }
    if count == 0 || last < first || !(first..=last).contains(&task) {
        return Err(ShardError::Uneven);
    }
    let step = (last - first) / (count - 1);
    let is_even = step > 0 && (last - first).is_multiple_of(count - 1);
    if !is_even || !(task - first).is_multiple_of(step) {
        return Err(ShardError::Uneven);
    }
    Ok(Shard { index: (task - first) / step, count })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(variables: &[(&str, &str)]) -> Result<Shard, ShardError> {
        let found = |name: &str| {
            let set = variables.iter().find(|(set, _)| *set == name);
            set.map(|(_, value)| (*value).to_owned())
        };
        Shard::of_scheduler(&found)
    }

    fn slurm(task: &str, count: &str, first: &str, last: &str) -> Result<Shard, ShardError> {
        of(&[
            ("SLURM_ARRAY_TASK_ID", task),
            ("SLURM_ARRAY_TASK_COUNT", count),
            ("SLURM_ARRAY_TASK_MIN", first),
            ("SLURM_ARRAY_TASK_MAX", last),
        ])
    }

    #[test]
    fn arguments_count_from_one() {
        assert_eq!("1/8".parse(), Ok(Shard { index: 0, count: 8 }));
        assert_eq!("8/8".parse(), Ok(Shard { index: 7, count: 8 }));
        for wrong in ["0/8", "9/8", "1", "1/0", "/", "a/2", "-1/2"] {
            assert_eq!(wrong.parse::<Shard>(), Err(ShardError::Form), "{wrong}");
        }
    }

    #[test]
    fn schedulers_say_which_shard_it_is() {
        assert_eq!(of(&[]), Ok(Shard::WHOLE));
        assert_eq!(slurm("3", "4", "1", "4"), Ok(Shard { index: 2, count: 4 }));
        assert_eq!(slurm("0", "4", "0", "3"), Ok(Shard { index: 0, count: 4 }));
        assert_eq!(slurm("20", "3", "10", "30"), Ok(Shard { index: 1, count: 3 }));
        // Running a single task of an array again does all the rest.
        assert_eq!(slurm("5", "1", "5", "5"), Ok(Shard::WHOLE));
        let kubernetes = [("JOB_COMPLETION_INDEX", "2"), ("BORESIGHT_SHARDS", "3")];
        assert_eq!(of(&kubernetes), Ok(Shard { index: 2, count: 3 }));
        let aws = [("AWS_BATCH_JOB_ARRAY_INDEX", "0"), ("AWS_BATCH_JOB_ARRAY_SIZE", "2")];
        assert_eq!(of(&aws), Ok(Shard { index: 0, count: 2 }));
    }

    #[test]
    fn what_a_scheduler_leaves_open_is_not_guessed() {
        assert_eq!(slurm("7", "3", "1", "7"), Ok(Shard { index: 2, count: 3 }));
        assert_eq!(slurm("2", "3", "1", "6"), Err(ShardError::Uneven));
        assert_eq!(slurm("2", "3", "1", "5"), Err(ShardError::Uneven));
        let error = of(&[("JOB_COMPLETION_INDEX", "2")]).expect_err("no count");
        assert!(error.to_string().contains("BORESIGHT_SHARDS"), "{error}");
        let outside = [("JOB_COMPLETION_INDEX", "3"), ("BORESIGHT_SHARDS", "3")];
        assert!(matches!(of(&outside), Err(ShardError::Value { .. })));
        let nonsense = [("AWS_BATCH_JOB_ARRAY_INDEX", "x")];
        assert!(matches!(of(&nonsense), Err(ShardError::Value { .. })));
    }

    #[test]
    fn every_item_is_in_one_shard() {
        for count in [1, 2, 7, 64] {
            for number in 0..200 {
                let shards = (0..count).filter(|&index| Shard { index, count }.has(number)).count();
                assert_eq!(shards, 1);
            }
        }
    }
}
