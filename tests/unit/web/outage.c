/* SPDX-License-Identifier: MIT */
/* Messages to the operator about a daemon that is away (client/web/outage.h). */
#include "tests/harness/test.h"
#include "web/outage.h"

#define BEGIN_NS 5000000000ull

TEST(an_outage_is_told_once_and_its_end_once)
{
    struct web_outage outage;
    web_outage_init(&outage);
    assert_false(web_outage_ends(&outage)); /* nothing was */
    assert_true(web_outage_begins(&outage, BEGIN_NS));
    for (uint64_t at_ns = BEGIN_NS; at_ns < BEGIN_NS + 3600000000000ull; at_ns += 1000000000ull)
        assert_false(web_outage_begins(&outage, at_ns)); /* browsers try again */
    assert_true(web_outage_ends(&outage));
    assert_false(web_outage_ends(&outage)); /* the next browser */
}

TEST(outages_that_follow_each_other_are_told_at_most_every_ten_seconds)
{
    struct web_outage outage;
    web_outage_init(&outage);
    unsigned begins = 0, ends = 0;
    for (unsigned ms = 0; ms < 60000; ms += 100) {
        begins += web_outage_begins(&outage, BEGIN_NS + ms * 1000000ull);
        ends += web_outage_ends(&outage);
    }
    assert_int_equal(begins, 6);
    assert_int_equal(ends, begins);
    /* An outage that was not reported, as it came soon after another, is reported if it lasts. */
    assert_false(web_outage_begins(&outage, BEGIN_NS + 59900000000ull));
    assert_true(web_outage_begins(&outage, BEGIN_NS + 60000000000ull));
}
