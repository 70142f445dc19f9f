// Text inside XML: JUnit's and SVG's.
#pragma once

#include <string>

namespace gnomon {

/// For content and for attributes in double quotes; control characters, which XML cannot hold, are
/// left out.
std::string escapedXml(const std::string& text);

}  // namespace gnomon
