// The beginning and the end of every HTML page that shakebed writes. Style and scripts are the files of report/page/,
// part of the program. A page is one file and loads nothing.
#pragma once

#include <string>

namespace shakebed::pipelines {

// The page up to and with its headline.
std::string page_head(const std::string& title);
// The scripts, and the end of the page. Without scripts answer, figures and tables are there all the same.
std::string page_tail();

}  // namespace shakebed::pipelines
