/* Something this model has not. */
#include "mark.h"

int main(void) {
    TCCR0 = 1 << WGM00 | 1;
    end();
}
