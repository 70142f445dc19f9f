// What a person sees: colours and a progress line on a terminal, plain lines elsewhere.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

namespace gnomon {

enum class Colour { kNone, kGreen, kYellow, kRed };

/// Human output to one stream; standard error when standard output carries JSON.
class Terminal {
 public:
  explicit Terminal(std::FILE* stream);
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// The text in a colour, where the stream is a terminal and NO_COLOR is not set.
  std::string paint(Colour colour, const std::string& text) const;

  /// Prints whole lines, above the progress line if there is one.
  void print(const std::string& text);

  /// Replaces the progress line; nothing where the stream is not a terminal.
  void progress(const std::string& text);

 private:
  std::FILE* out;
  bool terminal;
  bool coloured;
  bool lineOpen = false;
};

/// Columns aligned by their widest cell; the first row is the head. `right` names the columns that
/// are numbers. Cells may be painted: escape sequences take no width.
std::string table(const std::vector<std::vector<std::string>>& rows, const std::string& right);

/// 1234567 -> "1,234,567".
std::string grouped(std::size_t n);

}  // namespace gnomon
