// What a run has found so far, in a file that outlives it: a run that is killed goes on where it
// was.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "harness/cases/session.h"

namespace gnomon {

/// A case's record, of the run itself or of its repetition at another width of a subgroup.
struct Result {
  unsigned width = 0;  ///< in bits, as harness/isolate/sweep.h counts them; 0: the run itself
  CaseRecord record{};
};

/// One line of JSON after another: {"fingerprint": TEXT}, then {"width", "record"} for each case as
/// it ends, then {"finished": true}. A line that was cut off is no result.
class Results {
 public:
  /// Takes up the file where it is of an unfinished run with this fingerprint, else begins afresh.
  /// Throws UsageError if it cannot be written.
  Results(std::filesystem::path file, const std::string& fingerprint);

  /// Of the run that was interrupted.
  const std::vector<Result>& found() const { return earlier; }
  /// Whether there was the file of an interrupted run, but of another one.
  bool replacesAnother() const { return another; }

  /// Written before it returns, as far as the death of this process is concerned.
  void append(const Result& result);
  void finish();

 private:
  void read(const std::string& fingerprint);
  void write(const std::string& line);

  std::filesystem::path path;
  std::ofstream out;
  std::vector<Result> earlier;
  bool another = false;
};

}  // namespace gnomon
