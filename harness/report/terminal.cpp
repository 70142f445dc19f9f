#include "harness/report/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>

namespace gnomon {
namespace {

const char* code(Colour colour) {
  switch (colour) {
    case Colour::kGreen:
      return "\033[32m";
    case Colour::kYellow:
      return "\033[33m";
    case Colour::kRed:
      return "\033[31m";
    case Colour::kNone:
      break;
  }
  return "";
}

/// Characters that show, escape sequences left out.
std::size_t visible(const std::string& text) {
  std::size_t n = 0;
  bool escape = false;
  for (const char c : text) {
    if (c == '\033') escape = true;
    if (!escape) n += (static_cast<unsigned char>(c) & 0xc0) != 0x80;  // not a UTF-8 continuation
    if (escape && c == 'm') escape = false;
  }
  return n;
}

std::size_t columns(std::FILE* stream) {
  winsize size{};
  return ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

Terminal::Terminal(std::FILE* stream)
    : out(stream),
      terminal(isatty(fileno(stream)) == 1),
      coloured(terminal && std::getenv("NO_COLOR") == nullptr) {}

Terminal::~Terminal() { progress(""); }

std::string Terminal::paint(Colour colour, const std::string& text) const {
  if (!coloured || colour == Colour::kNone) return text;
  return code(colour) + text + "\033[0m";
}

void Terminal::print(const std::string& text) {
  progress("");
  fmt::print(out, "{}\n", text);
  std::fflush(out);
}

void Terminal::progress(const std::string& text) {
  if (!terminal) return;
  if (lineOpen) fmt::print(out, "\r\033[K");
  fmt::print(out, "{}", text.substr(0, columns(out) - 1));
  lineOpen = !text.empty();
  std::fflush(out);
}

std::string table(const std::vector<std::vector<std::string>>& rows, const std::string& right) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (widths.size() <= c) widths.push_back(0);
      widths[c] = std::max(widths[c], visible(row[c]));
    }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string space(widths[c] - visible(row[c]), ' ');
      const bool number = c < right.size() && right[c] == 'r';
      line += (c > 0 ? "  " : "") + (number ? space + row[c] : row[c] + space);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string grouped(std::size_t n) {
  std::string digits = std::to_string(n);
  for (std::ptrdiff_t at = static_cast<std::ptrdiff_t>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), ",");
  return digits;
}

}  // namespace gnomon
