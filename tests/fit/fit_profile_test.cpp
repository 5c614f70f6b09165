#include "fit/fit_profile.hpp"

#include <gtest/gtest.h>
int main_placeholder_fit_profile;
