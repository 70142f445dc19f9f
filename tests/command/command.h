// Runs the built command as a user does and keeps what it said.
#pragma once

#include <filesystem>
#include <string>

namespace gnomon {

struct Said {
  int status = -1;
  std::string output;  ///< standard output, and error where it goes there
};

/// `gnomon ARGUMENTS`, through a shell; `streams` redirects standard error.
Said gnomonSays(const std::string& arguments, const std::string& streams = "2>&1");

/// A fresh folder that is removed with the object.
class Scratch {
 public:
  Scratch();
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return folder; }

  /// Writes a file into the folder and returns its path.
  std::filesystem::path file(const std::string& name, const std::string& text) const;

 private:
  std::filesystem::path folder;
};

}  // namespace gnomon
