// Runs the built command as a user does and keeps what it said.
#pragma once

#include <string>

#include "tests/scratch.h"

namespace gnomon {

struct Said {
  int status = -1;
  std::string output;  ///< standard output, and error where it goes there
};

/// `gnomon ARGUMENTS`, through a shell; `streams` redirects standard error.
Said gnomonSays(const std::string& arguments, const std::string& streams = "2>&1");

}  // namespace gnomon
